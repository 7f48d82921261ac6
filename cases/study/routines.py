"""The routines of wave energy: what they need of a study, and what they make of its table.

A routine adds variables to the dataset of a study, and facts for its report to the attributes `best` and `summary`.
"""

from __future__ import annotations

import math

import numpy as np

from cases.study.bem import check_file, check_generator, check_power, compare, compare_power, compare_radiation
from cases.study.design import base_scene
from cases.study.extremes import storm_extreme
from cases.study.plan import Study
from fsi.errors import SceneError

NEEDS = {  # routine -> names of which the study must have one, for each of these
    "damping_sweep": (("damping",),),
    "power_matrix": (("Hm0", "wave_height"), ("Te", "peak_period", "period")),
    "rao": (("period", "omega", "frequency"),),
    "radiation": (("omega", "period", "frequency"),),
    "free_decay": (),
    "extreme": (("seed",),),
}

WORDS = {  # suffix of what an extreme is fitted -> what it is
    "mode": "most probable largest of a storm",
    "95": "not passed in 95 of 100 storms",
    "95_low": "the same, lower end of its 95 % confidence interval",
    "95_high": "the same, upper end of its 95 % confidence interval",
    "seeds": "seeds that would bring it to +-10 %",
}


def check_routine(study: Study) -> None:
    """Raises SceneError where a study lacks a parameter that its routine is about."""
    for names in NEEDS.get(study.routine, ()):
        if not set(names) & set(study.parameters):
            fix = f"add [parameters.{names[0]}]"
            raise SceneError(f"{study.routine} needs a parameter named {' or '.join(names)}", key="parameters", fix=fix)
    if study.routine == "radiation":
        for name, parameter in study.parameters.items():
            if (parameter.key == "radiation.joint") != (name == "driven"):
                fix = "call it driven, and no other"
                raise SceneError("is the joint that is moved, or is called so", key=f"parameters.{name}", fix=fix)
    if study.routine == "power_matrix" and study.bem:
        check_power(study.bem, _waves(study), list(study.parameters))
    if study.bem:
        check_file(study.bem, study.routine)
        if (sea := base_scene(study).sea) and sea.current is not None:
            fault = "boundary elements know no current, and the scene has one"
            raise SceneError(fault, key="bem", fix="leave bem or sea.current out")
        if study.routine != "radiation":
            keys = [parameter.key for parameter in study.parameters.values()]
            check_generator(study.bem, base_scene(study), keys)
    if study.routine not in (None, "free_decay") and study.sampling.method != "grid":
        raise SceneError(f"{study.routine} needs a grid", key="sampling.method", fix="set method = 'grid'")


def _waves(study: Study):
    scene = base_scene(study)
    return scene.sea.waves if scene.sea else scene.waves


def analysed(study: Study, data):
    """The dataset of a study with what its routine adds; that of a study without one as it is."""
    if study.routine == "damping_sweep":
        return damping_sweep(data)
    if study.routine == "power_matrix":
        data = power_matrix(data)
        return compare_power(data, study.bem, _waves(study)) if study.bem and "power_matrix" in data else data
    if study.routine == "rao" and study.bem and "rao" in data:
        return compare(data, study.bem)
    if study.routine == "radiation" and study.bem and "added_mass" in data:
        data.attrs["driven"] = str(study.settings.get("radiation.joint", ""))
        return compare_radiation(data, study.bem)
    if study.routine == "extreme":
        return extreme(data, study.measure.storm_duration)
    return data


def damping_sweep(data):
    """Adds the optimum along `damping`: `best_damping` and `best_power`, the vertex of the parabola through the best
    point and its neighbours over the logarithm of the damping. Without an inner maximum the best point itself stands,
    and `best_inside` is 0."""
    if "mean_power" not in data:
        return data
    power, damping = data.mean_power.transpose(..., "damping"), data.damping.values.astype(float)
    best = np.full((3, *power.shape[:-1]), np.nan)
    for index in np.ndindex(power.shape[:-1]):
        best[(slice(None), *index)] = peak(damping, power.values[index])
    dims, units = power.dims[:-1], data.damping.attrs.get("units", "1")
    data["best_damping"] = dims, best[0], {"units": units, "long_name": "damping of the largest mean power"}
    data["best_power"] = dims, best[1], {"units": "W", "long_name": "largest mean power"}
    data["best_inside"] = dims, best[2], {"units": "1", "long_name": "1 where the optimum lies between the points"}
    return data


def peak(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Place and height of the maximum of y(x), and 1.0 where it lies inside the points; x > 0 in ascending order is
    taken by its logarithm, points that are nan are left out. Exact for a parabola in log x."""
    keep = np.isfinite(y)
    order = np.argsort(x[keep])
    x, y = x[keep][order], y[keep][order]
    if len(x) == 0:
        return math.nan, math.nan, 0.0
    top = int(np.argmax(y))
    if not 0 < top < len(x) - 1 or x[0] <= 0:
        return float(x[top]), float(y[top]), 0.0
    logs = np.log(x[top - 1 : top + 2])
    a, b, c = np.polyfit(logs - logs[1], y[top - 1 : top + 2], 2)
    shift = -b / (2 * a)
    return float(math.exp(logs[1] + shift)), float(c + b * shift / 2), 1.0


def power_matrix(data):
    """Adds the matrix: `power_matrix` [W] over wave height and period, the mean over seeds and everything else that
    is no design, its standard error `power_matrix_error`, and `capture_width_matrix` [m]."""
    if "mean_power" not in data:
        return data
    over = [dim for dim in data.mean_power.dims if dim == "seed"]
    count = data.mean_power.count(over) if over else 1
    mean = data.mean_power.mean(over, skipna=True) if over else data.mean_power
    words = f"mean absorbed power{', mean of the seeds' if over else ''}"
    data["power_matrix"] = mean.assign_attrs(units="W", long_name=words)
    if over:
        error = data.mean_power.std(over, ddof=1) / np.sqrt(count)
        data["power_matrix_error"] = error.assign_attrs(units="W", long_name="standard error of the mean of the seeds")
    if "wave_power" in data:
        flux = data.wave_power.mean(over) if over else data.wave_power
        width = mean / flux
        data["capture_width_matrix"] = width.assign_attrs(units="m", long_name="capture width")
    return data


def extreme(data, storm: float):
    """Adds for every largest value of a run (names that end in `_max`) the fit over the seeds: `..._mode` and `..._95`, the
    most probable largest value of a storm [s] and the one that 95 of 100 storms stay below, the latter's 95 % confidence
    interval `..._95_low` and `..._95_high`, and `..._seeds`, the runs that would bring that to +-10 %.

    A joint that came to an end stop in a run goes no further in any storm: its `motion_max` is bounded by it."""
    if "measured_seconds" not in data:
        return data
    repeats = max(storm / float(data.measured_seconds.median()), 1.0)
    for name in [str(n) for n in data.data_vars if str(n).endswith("_max")]:
        values = data[name].transpose(..., "seed")
        found = np.full((len(WORDS), *values.shape[:-1]), np.nan)
        for index in np.ndindex(values.shape[:-1]):
            maxima = values.values[index]
            maxima = maxima[np.isfinite(maxima)]
            if len(maxima) >= 3 and np.ptp(maxima) > 0:
                fit = storm_extreme(maxima, repeats)
                found[(slice(None), *index)] = fit.mode, fit.high, fit.high_low, fit.high_high, fit.seeds
        if name == "motion_max" and "end_stop" in data:
            reached = data[name].where(data.end_stop.notnull()).max("seed").transpose(*values.dims[:-1]).values
            found[:4] = np.where(np.isfinite(reached), np.fmin(found[:4], reached), found[:4])
            found[4] = np.where(np.isfinite(reached), np.nan, found[4])
        facts = data[name].attrs
        for (suffix, text), layer in zip(WORDS.items(), found, strict=True):
            units = "1" if suffix == "seeds" else facts["units"]
            data[f"{name}_{suffix}"] = (
                values.dims[:-1],
                layer,
                {"units": units, "long_name": f"{facts['long_name']}, {text}"},
            )
    data.attrs["repeats"] = repeats
    return data
