"""Free decay of a joint: its period, linear and quadratic damping."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cases.report.wave_figures import Figure
from fsi.errors import SceneError
from fsi.extras import require


@dataclass(frozen=True)
class Decay:
    """x'' + b1 x' + b2 |x'| x' + (2 pi / period)^2 (x - offset) = 0, and the rms of what the fit leaves of x."""

    period: float
    linear: float
    quadratic: float
    offset: float
    residual: float

    @property
    def damping_ratio(self) -> float:
        """Of the linear part, to the critical damping."""
        return self.linear * self.period / (4 * math.pi)


def identify(time: np.ndarray, values: np.ndarray) -> Decay:
    """Fit a decay to a series: values (n,) in m or rad at times (n,) [s]; b1 in 1/s, b2 in 1/m or 1/rad.

    The peaks give a first estimate (b1 + 8/(3 pi) omega a b2 = decrement rate over a half cycle of amplitude a, Faltinsen
    1990, section 7.1), least squares between the series and the solution of the equation the rest.
    Raises SceneError where there are fewer than three half cycles.
    """
    optimize = require("scipy.optimize", "study", "a free decay")
    time, values = np.asarray(time, float) - time[0], np.asarray(values, float)
    crossings, peaks = _half_cycles(time, values - np.mean(values[len(values) // 2 :]))
    if len(crossings) < 4:
        fix = "make the run longer, or the first displacement larger"
        raise SceneError(f"a decay needs three half cycles, the series has {max(len(crossings) - 1, 0)}", fix=fix)
    omega = math.pi / np.mean(np.diff(crossings))
    amplitude = np.abs(peaks)
    rate = 2 * np.log(amplitude[:-1] / amplitude[1:]) / (math.pi / omega)
    middle = np.sqrt(amplitude[:-1] * amplitude[1:])
    if len(rate) > 1:
        b1, b2 = np.linalg.lstsq(np.column_stack([np.ones_like(middle), 8 / (3 * math.pi) * omega * middle]), rate)[0]
    else:
        b1, b2 = rate[0], 0.0
    velocity = np.gradient(values, time)[0]
    scale = float(np.abs(values - values[-1]).max())
    first = [omega, max(b1, 0.0), max(b2, 0.0), float(np.mean(values[len(values) // 2 :])), values[0], velocity]
    least, most = values.min() - scale, values.max() + scale  # what is passive takes energy out: no damping below zero
    low = [0.2 * omega, 0.0, 0.0, least, least, -5 * scale * omega]
    high = [5 * omega, 4 * omega, 10 / scale, most, most, 5 * scale * omega]
    first = np.clip(first, low, high)
    unit = [omega, omega, 1 / scale, scale, scale, scale * omega]
    fit = optimize.least_squares(
        lambda p: (_solution(p, time) - values) / scale, first, bounds=(low, high), x_scale=unit
    )
    natural, b1, b2, offset = fit.x[:4]
    residual = scale * math.sqrt(float(np.mean(fit.fun**2)))
    return Decay(2 * math.pi / float(natural), float(b1), float(b2), float(offset), residual)


def _solution(parameters: np.ndarray, time: np.ndarray) -> np.ndarray:
    """x at the times, by the classical Runge-Kutta method in steps of a 60th of the period or less."""
    omega, b1, b2, offset, x, v = parameters
    steps = max(1, math.ceil((time[-1] / max(len(time) - 1, 1)) * omega * 60 / (2 * math.pi)))
    grid = np.interp(np.arange(steps * (len(time) - 1) + 1) / steps, np.arange(len(time)), time)

    def slope(x: float, v: float) -> tuple[float, float]:
        return v, -b1 * v - b2 * abs(v) * v - omega * omega * (x - offset)

    out = np.empty(len(grid))
    out[0] = x
    for n, h in enumerate(np.diff(grid)):
        k1 = slope(x, v)
        k2 = slope(x + h / 2 * k1[0], v + h / 2 * k1[1])
        k3 = slope(x + h / 2 * k2[0], v + h / 2 * k2[1])
        k4 = slope(x + h * k3[0], v + h * k3[1])
        x += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        v += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        out[n + 1] = x
    return out[::steps]


def _half_cycles(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times of the zero crossings, interpolated, and the peak between each and the next; once the motion has died down
    to a hundredth of its largest it counts no more."""
    index = np.flatnonzero(values[:-1] * values[1:] < 0)
    crossings = time[index] - values[index] * (time[index + 1] - time[index]) / (values[index + 1] - values[index])
    peaks = np.array([max(values[a + 1 : b + 1], key=abs) for a, b in pairwise(index)])
    alive = int(np.argmax(np.append(np.abs(peaks) < 0.01 * np.abs(values).max(), True)))
    return crossings[: alive + 1], peaks[:alive]


def decay_figures(data, joint: str, start: float) -> Iterator[Figure]:
    """Figures of the free decay in a run's dataset, of the joint named, or its first."""
    if "joint" not in data.dims:
        raise SceneError("a free decay needs a joint", key="bodies", fix="add a body with a hinge or slide")
    name = joint or str(data.joint.values[0])
    if name not in data.joint.values:
        fix = f"the run has {', '.join(map(str, data.joint.values))}"
        raise SceneError(f"no joint {name!r}", key="measure.decay_joint", fix=fix)
    part = data.joint_position.sel(joint=name, time=slice(start, None))
    decay = identify(part.time.values, part.values)
    units = "rad" if "joint_kind" in data.coords and str(data.joint_kind.sel(joint=name).item()) == "hinge" else "m"
    yield Figure("decay_period", decay.period, "s", "undamped natural period")
    yield Figure("decay_linear", decay.linear, "1/s", "linear damping over inertia")
    yield Figure("decay_quadratic", decay.quadratic, f"1/{units}", "quadratic damping over inertia")
    yield Figure("decay_ratio", decay.damping_ratio, "1", "linear damping over critical damping")
    yield Figure("decay_offset", decay.offset, units, "position at rest")
    yield Figure("decay_residual", decay.residual, units, "rms of the series less its fit")
