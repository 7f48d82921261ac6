"""Figures of a coastal structure: what it has to bear, what goes over it, how far the water comes, what is sent back."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from cases.report.figure import Figure, exceeded, load_figures
from cases.report.obstacles import obstacles
from fsi.scene.geometry import wave_depth
from fsi.scene.model import Scene
from fsi.waves import wavenumber

FLOW = 0.01  # share of the largest discharge, above which water is said to flow over
GAP = 0.25  # of a period without flow, after which a new event begins
BAND = (0.5, 2.5)  # of the peak frequency, in which the waves of a sea are separated
LEAST_ANGLE = (
    0.3  # sum of sin^2 of the phases between gauges over their pairs, below which they cannot tell waves apart
)
RUNUP_SHARE = 0.02  # of the waves that exceed the run-up R2%


def coast_figures(part, scene: Scene, period: float | None, regular: bool, settled: Callable) -> Iterator[Figure]:
    """All of them; `part` is the settled part of a run's dataset, `period` [s] that of regular waves or of the peak, `settled`
    gives the time [s] at which the waves of a scene have come to a place [m]."""
    yield from _loads(part)
    yield from _overtopping(part, scene, period, regular)
    yield from _shore(part, period)
    yield from reflection(part, scene, period, regular, settled)


def _loads(part) -> Iterator[Figure]:
    for name in map(str, part.structure.values) if "structure" in part.dims else ():
        for kind, units in (("force", "N"), ("torque", "N m")):
            load = part[f"load_{kind}"].sel(structure=name).values
            yield from load_figures(load, f"load_{kind}", units, f"{kind} on the structure", "structure", name)


def _overtopping(part, scene: Scene, period: float | None, regular: bool) -> Iterator[Figure]:
    seconds = float(part.time[-1] - part.time[0])
    for name in map(str, part.flux.values) if "flux" in part.dims and seconds > 0 else ():
        passed = part.passed_volume.sel(flux=name).values
        mean = float(passed[-1] - passed[0]) / seconds
        yield Figure("discharge_mean", mean, "m3/s", "mean discharge", "flux", name)
        width = plane_width(scene, name)
        if width:
            yield Figure("discharge_per_metre", 1000 * mean / width, "l/s/m", "mean discharge per metre", "flux", name)
        if period and regular:
            yield Figure("volume_per_wave", mean * period, "m3", "mean volume of a wave", "flux", name)
        volumes = events(part.time.values, part.discharge.sel(flux=name).values, GAP * period if period else 0.0)
        yield Figure("discharge_events", float(len(volumes)), "1", "times that water went over", "flux", name)
        if len(volumes):
            yield Figure("volume_max", float(volumes.max()), "m3", "largest volume at a time", "flux", name)


def plane_width(scene: Scene, name: str) -> float:
    """Horizontal width [m] of a flux plane; 0 of a level one."""
    if scene.dimension == 2:
        return scene.tank.width if scene.fluxes[name].axis == 0 else 0.0
    plane = scene.fluxes[name]
    return 0.0 if plane.axis == 2 else plane.max[1 - plane.axis] - plane.min[1 - plane.axis]


def events(time: np.ndarray, rate: np.ndarray, gap: float) -> np.ndarray:
    """Volume [m3] of each time that water goes over at the rates (n,) [m3/s], of which each is the mean since the time (n,) [s]
    before it; those less than `gap` [s] apart count as one."""
    rate = np.maximum(rate, 0.0)
    flows = rate > FLOW * rate.max(initial=0.0)
    volume = rate * np.diff(time, prepend=time[0])
    found: list[float] = []
    last = -math.inf
    for t, flowing, v in zip(time, flows, volume, strict=True):
        if not flowing:
            continue
        if found and t - last <= gap + 1.5 * float(np.median(np.diff(time))):
            found[-1] += v
        else:
            found.append(v)
        last = t
    return np.array(found)


def _shore(part, period: float | None) -> Iterator[Figure]:
    for name in map(str, part.runup.values) if "runup" in part.dims else ():
        height = part.runup_height.sel(runup=name).values
        known = height[np.isfinite(height)]
        if not known.size:
            continue
        yield Figure("runup_max", float(known.max()), "m", "highest run-up", "runup", name)
        step = float(np.median(np.diff(part.time.values)))
        tops = peaks(known, max(1, round(0.25 * period / step))) if period else known[:0]
        if tops.size >= 10:
            level = exceeded(tops, RUNUP_SHARE)
            yield Figure("runup_2pct", level, "m", "run-up that 2 % of its maxima exceed", "runup", name)
    for name in map(str, part.area.values) if "area" in part.dims else ():
        largest = float(part.wet_area.sel(area=name).max())
        yield Figure("wet_area_max", largest, "m2", "largest flooded area", "area", name)
    for name in map(str, part.depth.values) if "depth" in part.dims else ():
        largest = float(part.layer_thickness.sel(depth=name).max())
        yield Figure("thickness_max", largest, "m", "largest thickness of the layer", "depth", name)


def peaks(values: np.ndarray, apart: int) -> np.ndarray:
    """Local maxima, each the largest within so many samples to both sides."""
    span = np.lib.stride_tricks.sliding_window_view(np.pad(values, apart, constant_values=-np.inf), 2 * apart + 1)
    top = values >= span.max(1)
    return values[np.flatnonzero(top & np.append(True, ~top[:-1]))]


def reflection(part, scene: Scene, period: float | None, regular: bool, settled: Callable) -> Iterator[Figure]:
    """Heights of the incident and the reflected waves and their ratio, from all gauges before the first body and the damping
    zones, by least squares (Mansard & Funke 1980; Zelt & Skjelbreia 1992), from when the reflected waves are back at all of
    them. Nothing where they cannot be told apart (`separated`)."""
    found = separated(part, scene, period, regular, settled)
    if isinstance(found, str):
        return
    incident, reflected = found
    what = "height of the first harmonic of the" if regular else "significant height of the"
    yield Figure("incident_height", incident, "m", f"{what} incident waves")
    yield Figure("reflected_height", reflected, "m", f"{what} reflected waves")
    if incident > 0:
        yield Figure("reflection_coefficient", reflected / incident, "1", "reflected over incident wave height")


def separated(part, scene: Scene, period: float | None, regular: bool, settled: Callable) -> tuple[float, float] | str:
    """Height [m] of the incident and of the reflected waves of a flume; or why they cannot be told apart, in words, which are
    empty where nobody would expect it."""
    if scene.waves is None or period is None or len(scene.gauges) < 2:
        return ""
    names, end = separating_gauges(part, scene)
    if len(names) < 2:
        return f"fewer than two gauges stand before x = {end:.4g} m, up to where the water is free and as deep as at the piston"
    x = np.array([scene.gauges[name].x for name in names])
    part = part.sel(time=slice(settled(scene, 2 * end - float(x.min())) - 1e-9, None))
    lasts = float(part.time[-1] - part.time[0]) if part.sizes["time"] > 1 else 0.0
    periods = math.floor(lasts / period + 1e-6)
    if periods < (needed := 1 if regular else 10):
        return f"the reflected waves are back at the gauges for {lasts:.3g} s, and {needed * period:.3g} s are needed"
    if regular:
        part = part.sel(time=slice(float(part.time[-1]) - periods * period - 1e-9, None))
    eta = np.stack([part.elevation.sel(gauge=name).values for name in names])
    if not np.isfinite(eta).all():
        return "a gauge falls dry"
    separate = separate_regular if regular else separate_sea
    found = separate(part.time.values, eta, x, period, wave_depth(scene), scene.gravity)
    return "the gauges stand nearly whole half wave lengths apart" if found is None else found


def separating_gauges(part, scene: Scene) -> tuple[list[str], float]:
    """Names of the gauges between the piston and what may reflect its waves, and where that is [m]: the first body or fixed
    solid, a floor that rises, the beginning of a damping zone, or the end of the tank."""
    if scene.waves is None or "gauge" not in part.dims:
        return [], 0.0
    ends = [min(zone.start, zone.end) for zone in scene.damping if zone.axis == "x"]
    ends += [place for place in obstacles(scene) if math.isfinite(place)]
    if "body_position" in part:
        ends.append(float(part.body_position.isel(time=0).sel(axis="x").min()))
    end, middle = min(ends, default=scene.tank.max[0]), scene.gauges
    near = [n for n in map(str, part.gauge.values) if n in middle and middle[n].x < end]
    rows = {n: (middle[n].y if scene.dimension == 3 else 0.0) for n in near}
    if not near:
        return [], end
    row = max(rows.values(), key=list(rows.values()).count)  # those one behind the other
    return [n for n in near if rows[n] == row], end


def separate_regular(time, eta, x, period: float, depth: float, g: float) -> tuple[float, float] | None:
    """Height [m] of the incident and the reflected wave of this period from elevations (gauges, n) at x (gauges,)."""
    omega = 2 * math.pi / period
    columns = np.column_stack([np.ones_like(time), np.cos(omega * time), -np.sin(omega * time)])
    fit = np.linalg.lstsq(columns, eta.T, rcond=None)[0]
    pair = _split(fit[1] + 1j * fit[2], x, wavenumber(omega, depth, g))
    return None if pair is None else (2 * abs(pair[0]), 2 * abs(pair[1]))


def separate_sea(time, eta, x, peak_period: float, depth: float, g: float) -> tuple[float, float] | None:
    """Significant height [m] of the incident and the reflected waves of a sea, component by component between 0.5 and 2.5 of
    the peak's frequency; components that the gauges cannot tell apart are given the mean share of the others."""
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1], step)
    eta = np.stack([np.interp(even, time, row) for row in eta])
    window = np.hanning(len(even))
    gain = math.sqrt((window**2).mean())
    spectra = 2 * np.fft.rfft((eta - eta.mean(1, keepdims=True)) * window, axis=1) / (len(even) * gain)
    f = np.fft.rfftfreq(len(even), step)
    kept = np.flatnonzero((f >= BAND[0] / peak_period) & (f <= BAND[1] / peak_period))
    pairs = [_split(spectra[:, n], x, wavenumber(2 * math.pi * f[n], depth, g)) for n in kept]
    told = np.array([pair is not None for pair in pairs], bool)
    if told.sum() < 5:
        return None
    energy = np.array([np.abs(pair) ** 2 / 2 for pair in pairs if pair is not None])
    both = (np.abs(spectra[:, kept]) ** 2 / 2).mean(0)
    share = both.sum() / both[told].sum()
    incident, reflected = share * energy.sum(0)
    return 4 * math.sqrt(incident), 4 * math.sqrt(reflected)


def _split(amplitude: np.ndarray, x: np.ndarray, k: float) -> np.ndarray | None:
    """Complex amplitudes of a exp(i (omega t - k x)) + b exp(i (omega t + k x)) by least squares over the gauges; None where
    these stand nearly whole half wave lengths apart."""
    phase = k * (x - x[0])
    apart = phase[:, None] - phase[None, :]
    pairs = len(x) * (len(x) - 1)
    if (np.sin(apart) ** 2).sum() / pairs < LEAST_ANGLE**2:
        return None
    columns = np.stack([np.exp(-1j * phase), np.exp(1j * phase)], 1)
    return np.linalg.lstsq(columns, amplitude, rcond=None)[0]
