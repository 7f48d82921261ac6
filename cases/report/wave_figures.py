"""Figures of a run in waves: what a wave converter absorbs, how its joints answer, what it has to bear.

All are taken between the time at which the waves have settled at the bodies and the end of the run; in regular waves
over whole periods. Phases count from the crest of the incident wave at the body, a lead is positive.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from cases.report.coast_figures import coast_figures, separated
from cases.report.figure import Figure, load_figures
from cases.report.obstacles import obstacles
from fsi.errors import SceneError
from fsi.scene.geometry import piston_motion, wave_depth
from fsi.scene.model import Scene
from fsi.waves import wavenumber

JOLT = 2.0  # sqrt(depth / g) that the jolt of a run's first steps lasts
MOVED = 0.01  # share of the piston's stroke
STOP = re.compile(r"joint '(.+)' at its (?:(upper|lower) )?limit(?:, (\S+) (rad|m))?")
PRESSURE_MEAN = 0.01  # s over which the largest pressure is a mean, at least; of three samples or more
STUDENT_95 = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23)  # two-sided, 1, 2, ... degrees of freedom


def group_speed(omega: float, depth: float, g: float) -> float:
    """Speed of the energy of a linear wave [m/s] (Dean & Dalrymple 1991, eq. 4.85)."""
    k = wavenumber(omega, depth, g)
    kd = k * depth
    n = 0.5 * (1 + (2 * kd / math.sinh(2 * kd) if kd < 300 else 0.0))
    return n * omega / k


def wave_power(height: float, period: float, depth: float, rho: float, g: float) -> float:
    """Power of a regular linear wave per metre of crest, rho g H^2 / 8 times the group speed [W/m]."""
    return rho * g * height**2 / 8 * group_speed(2 * math.pi / period, depth, g)


def harmonic(time: np.ndarray, values: np.ndarray, omega: float) -> complex:
    """Complex amplitude X of the least-squares fit mean + Re(X exp(i omega t)), exact for that signal."""
    columns = np.column_stack([np.ones_like(time), np.cos(omega * time), -np.sin(omega * time)])
    _, real, minus_imaginary = np.linalg.lstsq(columns, values, rcond=None)[0]
    return complex(real, minus_imaginary)


def mean_and_error(values: np.ndarray, batches: int) -> tuple[float, float]:
    """Mean and the half width of its 95 % confidence interval from the means of consecutive batches, which are taken as
    independent (Law & Kelton 2000, section 9.5.3); nan for fewer than two batches."""
    mean = float(np.mean(values))
    if batches < 2:
        return mean, math.nan
    means = [float(np.mean(part)) for part in np.array_split(values, batches)]
    factor = STUDENT_95[batches - 2] if batches - 2 < len(STUDENT_95) else 1.96 + 2.5 / (batches - 1)
    return mean, factor * float(np.std(means, ddof=1)) / math.sqrt(batches)


def settled(scene: Scene, place: float) -> float:
    """When the waves have settled at x = `place` [m]: their ramp, and their way there at the group speed [s]. Of waves that
    pass, when they can first be there: what comes before is the water at rest, and the jolt of the run's first steps."""
    waves = scene.waves
    period = wave_period(scene)
    if waves is None:
        return 0.0
    if period is None:
        return arrival(scene, place)
    ramp = getattr(waves, "ramp", None)
    speed = group_speed(2 * math.pi / period, wave_depth(scene), scene.gravity)
    ramp = 2 * period if ramp is None else ramp
    return max(ramp + max(place - scene.tank.min[0], 0.0) / speed, jolt(scene))


def jolt(scene: Scene) -> float:
    """How long the jolt of a run's first steps lasts in water at rest [s]."""
    return JOLT * math.sqrt(wave_depth(scene) / scene.gravity) if scene.gravity else 0.0


def arrival(scene: Scene, place: float) -> float:
    """The earliest time [s] at which the piston's waves can be at x = `place` [m]: it has moved by a hundredth of its stroke,
    and long waves have gone there over water that is a quarter deeper. Not before the jolt of the start is over."""
    depth, motion = wave_depth(scene), piston_motion(scene)
    if motion is None:
        return jolt(scene)
    times = np.linspace(0.0, scene.duration, 4001)
    way = np.array([motion(float(t))[0] for t in times])
    moved = np.abs(way - way[0]) > MOVED * max(float(np.ptp(way)), 1e-12)
    begin = float(times[max(int(np.argmax(moved)) - 1, 0)]) if moved.any() else 0.0
    return max(begin + max(place - scene.tank.min[0], 0.0) / math.sqrt(1.25 * scene.gravity * depth), jolt(scene))


def wave_period(scene: Scene) -> float | None:
    """Period of regular waves, peak period of irregular ones [s]; None without either."""
    for name in ("period", "peak_period"):
        value = getattr(scene.waves, name, None)
        if value is not None:
            return float(value)
    return None


def is_regular(scene: Scene) -> bool:
    """Whether the scene's waves are one linear wave that goes on for the whole run."""
    return scene.waves is not None and len(scene.waves.linear_waves(wave_depth(scene), scene.gravity)) == 1


def window(data, scene: Scene, start: float | None = None):
    """The part of a run's dataset that figures are taken from, and the period [s] or None; SceneError where that part is
    shorter than a period."""
    end = float(data.time[-1]) if data.sizes["time"] else 0.0
    places = data.body_position.isel(time=0).sel(axis="x").values if "body_position" in data else np.zeros(0)
    fixed = obstacles(scene)[1]
    places = np.append(places, fixed if math.isfinite(fixed) else scene.tank.min[0])
    begin = settled(scene, float(places.max())) if start is None else start
    period = wave_period(scene)
    if begin + (period or 0.0) > end + 1e-6 or end <= 0:
        fault = f"the run ends at {end:.3g} s, figures need it to last {begin + (period or 0.0):.3g} s"
        raise SceneError(fault, key="duration", fix="make the run longer, or set measure.start")
    if period and is_regular(scene):
        begin = end - period * math.floor((end - begin) / period + 1e-6)
    return data.sel(time=slice(begin - 1e-9, None)), period


def not_separated(data, scene: Scene) -> str:
    """Why incident and reflected waves of a flume with two gauges or more have no figures, in words; empty where they have."""
    try:
        part, period = window(data, scene)
    except SceneError:
        return ""
    found = separated(part, scene, period, is_regular(scene), settled)
    return found if isinstance(found, str) else ""


def measured_seconds(data, scene: Scene, start: float | None = None) -> float:
    """Length of the part of a run that figures are taken from [s]."""
    part, _ = window(data, scene, start)
    return float(part.time[-1] - part.time[0])


def figures(data, scene: Scene, *, start: float | None = None, device_width: float | None = None) -> list[Figure]:
    """All figures of a run: `data` is what `fsi.load_run` returns, `start` [s] replaces the time at which the waves
    have settled, `device_width` [m] is that of the capture width ratio. Raises SceneError for a run that is too short."""
    part, period = window(data, scene, start)
    width = device_width or (scene.tank.width if scene.dimension == 2 else None)
    return [
        *_joints(part, scene, period),
        *_end_stops(part),
        *_power(part, scene, period, width),
        *_bodies(part),
        *_answers(part, scene, period),
        *_gauges(part, scene, period),
        *_probes(part),
        *coast_figures(part, scene, period, is_regular(scene), settled),
    ]


def _joints(part, scene: Scene, period: float | None) -> Iterator[Figure]:
    if "joint" not in part.dims:
        return
    rotary = [str(kind) == "hinge" for kind in part.joint_kind.values] if "joint_kind" in part.coords else []
    incident = _incident(part, scene, period)
    for n, name in enumerate(map(str, part.joint.values)):
        units, load = ("rad", "N m") if n < len(rotary) and rotary[n] else ("m", "N")
        position = part.joint_position.values[:, n]
        yield Figure("motion_max", float(np.abs(position).max()), units, "largest joint position", "joint", name)
        yield Figure("motion_rms", float(position.std()), units, "standard deviation of the joint", "joint", name)
        force = np.abs(part.joint_force.values[:, n])
        yield Figure("joint_force_max", float(force.max()), load, "largest load of spring and damper", "joint", name)
        mean, error = mean_and_error(part.pto_power.values[:, n], _batches(part, period))
        yield Figure("absorbed_power", mean, "W", "mean absorbed power", "joint", name)
        yield Figure("absorbed_power_error", error, "W", "95 % confidence of the mean absorbed power", "joint", name)
        if incident:
            response = harmonic(part.time.values, position, 2 * math.pi / period) / incident
            yield Figure("rao", abs(response), f"{units}/m", "motion over wave amplitude", "joint", name)
            yield Figure("rao_phase", float(np.angle(response)), "rad", "lead over the incident crest", "joint", name)


def _incident(part, scene: Scene, period: float | None) -> complex:
    """Complex amplitude [m] of a regular wave of the piston at the first body, by linear theory; 0 for other waves."""
    if period is None or not is_regular(scene) or "body_position" not in part:
        return 0.0
    k = wavenumber(2 * math.pi / period, wave_depth(scene), scene.gravity)
    place = float(part.body_position.sel(axis="x").values[:, 0].mean()) - scene.tank.min[0]
    [(height, _)] = scene.waves.linear_waves(wave_depth(scene), scene.gravity)
    return 0.5 * height * np.exp(-1j * k * place)


def _power(part, scene: Scene, period: float | None, width: float | None) -> Iterator[Figure]:
    if "pto_power" not in part:
        return
    mean, error = mean_and_error(part.pto_power.values.sum(axis=1), _batches(part, period))
    yield Figure("mean_power", mean, "W", "mean absorbed power of all joints")
    yield Figure("mean_power_error", error, "W", "95 % confidence of the mean power")
    flux = incident_power(scene)
    if flux:
        yield Figure("wave_power", flux, "W/m", "power of the incident waves per metre of crest")
        yield Figure("capture_width", mean / flux, "m", "mean absorbed power over wave power")
        if width:
            yield Figure("capture_width_ratio", mean / flux / width, "1", "capture width over device width")


def incident_power(scene: Scene) -> float | None:
    """Power of the scene's waves per metre of crest by linear theory [W/m]; of irregular waves that of the components
    that make them up. None for waves that do not go on."""
    depth, g = wave_depth(scene), scene.gravity
    parts = scene.waves.linear_waves(depth, g) if scene.waves else []
    return sum(wave_power(height, period, depth, scene.fluid.density, g) for height, period in parts) if parts else None


def energy_period_ratio(waves) -> float:
    """Energy period m-1 / m0 over peak period of irregular waves, of the spectrum they are drawn from."""
    from fsi.waves.kinds.irregular import LOWEST, spectrum

    f = np.linspace(LOWEST, waves.highest, 20_001)
    density = spectrum(f, 1.0, 1.0 if waves.spectrum == "pierson_moskowitz" else waves.gamma or 3.3)
    return float((density / f).sum() / density.sum())


def _end_stops(part) -> Iterator[Figure]:
    """How often each joint came to an end stop, and where that is, of the joints that did."""
    if "joint" not in part.dims or "event_text" not in part:
        return
    kinds = dict(zip(part.joint.values, part.joint_kind.values, strict=True)) if "joint_kind" in part.coords else {}
    hits: dict[str, list[float]] = {}
    begin = float(part.time[0])
    for time, text in zip(part.event_time.values, part.event_text.values, strict=True):
        if (found := STOP.search(str(text))) and time >= begin and found[1] in part.joint.values:
            hits.setdefault(found[1], []).append(abs(float(found[3])) if found[3] else math.nan)
    for name in map(str, part.joint.values):
        stops = hits.get(name, [])
        yield Figure("end_stop_hits", float(len(stops)), "1", "times that the joint came to an end stop", "joint", name)
        if stops:
            units = "rad" if kinds.get(name) == "hinge" else "m"
            yield Figure("end_stop", max(stops), units, "position of the end stop that was reached", "joint", name)


def _bodies(part) -> Iterator[Figure]:
    for name in map(str, part.body.values) if "body" in part.dims else ():
        for kind, units in (("force", "N"), ("torque", "N m")):
            load = part[f"body_{kind}"].sel(body=name).values
            yield from load_figures(load, kind, units, f"fluid {kind}", "body", name)


def _answers(part, scene: Scene, period: float | None) -> Iterator[Figure]:
    """Of bodies that move in a regular wave: how fast they drift, at which period they then meet the waves, and at that
    the amplitudes of surge, heave and pitch over the wave's."""
    if not _incident(part, scene, period) or "body_quaternion" not in part or part.sizes["time"] < 8:
        return
    t, omega = part.time.values, 2 * math.pi / period
    k = wavenumber(omega, wave_depth(scene), scene.gravity)
    amplitude = abs(_incident(part, scene, period))
    for name in map(str, part.body.values):
        place = part.body_position.sel(body=name)
        motions = {"surge": place.sel(axis="x").values, "heave": place.sel(axis="z").values}
        motions["pitch"] = pitch(part.body_quaternion.sel(body=name).values)
        if max(np.ptp(values) for values in motions.values()) < 1e-9:
            continue
        met = omega
        for _ in range(3):  # the drift turns the encounter, and the encounter is fitted beside the drift
            drift = steady(t, motions["surge"], met)[0]
            met = max(omega - k * drift, 0.1 * omega)
        yield Figure("drift", drift, "m/s", "mean surge velocity", "body", name)
        yield Figure("encounter_period", 2 * math.pi / met, "s", "period at which it meets the waves", "body", name)
        for motion, values in motions.items():
            units = "rad/m" if motion == "pitch" else "m/m"
            response = steady(t, values, met)[1] / amplitude
            yield Figure(f"{motion}_rao", response, units, f"{motion} over wave amplitude", "body", name)


def steady(t: np.ndarray, values: np.ndarray, omega: float) -> tuple[float, float]:
    """Rate and amplitude of the least-squares fit of a line and a harmonic of omega [rad/s] to values (n,)."""
    columns = np.stack([np.ones_like(t), t - t[0], np.cos(omega * t), np.sin(omega * t)], 1)
    _, rate, cosine, sine = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(rate), math.hypot(cosine, sine)


def pitch(quaternion: np.ndarray) -> np.ndarray:
    """Pitch (n,) [rad] from unit quaternions (n, 4) wxyz: how far the body's vertical leans towards +x."""
    w, x, y, z = quaternion.T
    return np.unwrap(np.arctan2(2 * (x * z + w * y), 1 - 2 * (x**2 + y**2)))


def _gauges(part, scene: Scene, period: float | None) -> Iterator[Figure]:
    regular = is_regular(scene)
    for name in map(str, part.gauge.values) if "gauge" in part.dims else ():
        eta = part.elevation.sel(gauge=name).values
        if regular:
            height = 2 * abs(harmonic(part.time.values, eta, 2 * math.pi / period))
            yield Figure("gauge_height", height, "m", "height of the first harmonic", "gauge", name)
        else:
            yield Figure("gauge_Hm0", 4 * float(eta.std()), "m", "significant height", "gauge", name)
        yield Figure("crest_max", float(eta.max()), "m", "highest elevation", "gauge", name)


def _probes(part) -> Iterator[Figure]:
    for name in map(str, part.probe.values) if "probe" in part.dims else ():
        value = part.pressure.sel(probe=name).values
        over, mean = running_mean(part.time.values, value, PRESSURE_MEAN)
        title = f"largest mean pressure over {1000 * over:.3g} ms"
        yield Figure("pressure_max", float(mean.max()), "Pa", title, "probe", name)
        yield Figure("pressure_peak", float(value.max()), "Pa", "largest sample of the pressure", "probe", name)


def running_mean(t: np.ndarray, values: np.ndarray, over: float) -> tuple[float, np.ndarray]:
    """Means of values (n,) at times t (n,) over spans of so many seconds, or of three samples where that is longer; the length
    of the spans [s] and the means of those that lie within the record, of all of it where it is shorter."""
    if len(t) < 2:
        return 0.0, values
    over = max(over, 2 * float(np.median(np.diff(t))))
    total = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (values[1:] + values[:-1]))])
    ends = t[t >= t[0] + over * (1 - 1e-9)]
    if len(ends) == 0:
        return float(t[-1] - t[0]), np.array([total[-1] / (t[-1] - t[0])])
    return over, (np.interp(ends, t, total) - np.interp(ends - over, t, total)) / over


def _batches(part, period: float | None) -> int:
    """Batches of a mean: one a period, ten where there is none."""
    if period is None or part.sizes["time"] < 20:
        return 10 if part.sizes["time"] >= 20 else 1
    return int((float(part.time[-1]) - float(part.time[0])) / period + 0.5)
