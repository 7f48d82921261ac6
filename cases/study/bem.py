"""Linear theory beside a study: reads the netCDF datasets of Capytaine (Ancellin & Dias 2019) and solves the equation of
motion with them.

Capytaine's fields vary as exp(-i omega t), so that (-omega^2 (M + A) - i omega (B + b) + K + k) X = F for the motion X of
a wave of unit amplitude whose crest is at the origin at t = 0; b and k are damping and stiffness of the power take-off.

The joints of a scene are modes of the degrees of freedom x of a dataset, x = T q: a slide between two bodies moves both. In
the joints q the matrices are T' A T, the forces T' F (Newman 1994, generalised modes).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cases.study.plan import Bem
from fsi.errors import SceneError
from fsi.extras import require
from fsi.trust import check_bytes

MOST_BYTES = 1e9  # of a dataset
RADIATED = ("added_mass", "radiation_damping")
NEEDED = (*RADIATED, "inertia_matrix", "hydrostatic_stiffness")
SEAS = ("regular", "irregular")  # waves whose power linear theory gives
HEIGHTS, PERIODS = {"Hm0", "wave_height"}, {"Te", "peak_period", "period"}  # what a power matrix is over
COVERED = 0.98  # of the energy of a sea, that the frequencies of a file must hold
MATRIX = ("influenced_dof", "radiating_dof")
Modes = Mapping[str, Mapping[str, float]]  # joint -> degree of freedom -> what it moves by for one unit of the joint


def read_bem(file: Path, needed: Sequence[str] = NEEDED):
    """The dataset of a file with complex numbers put together (Capytaine writes them along `complex`: re, im), its frequencies
    finite, above zero and ascending; where all of `NEEDED` is asked for also the sum of Froude-Krylov and diffraction force as
    `excitation`. Raises SceneError where something is missing."""
    xarray = require("xarray", "report", "a comparison with linear theory")
    require("h5netcdf", "report", "a comparison with linear theory")
    check_bytes(Path(file), MOST_BYTES, "write it with fewer frequencies, and without the mesh")
    try:
        with xarray.open_dataset(file, engine="h5netcdf") as opened:
            data = opened.load()
    except (OSError, ValueError) as fault:
        raise SceneError(f"cannot be read: {fault}", file=file, key="bem.file", fix="give Capytaine's netCDF") from None
    if "complex" in data.dims:
        joined = {
            n: data[n].sel(complex="re") + 1j * data[n].sel(complex="im") for n in data if "complex" in data[n].dims
        }
        data = data.drop_vars([*joined, "complex"]).assign(joined)
    missing = [name for name in needed if name not in data]
    if "excitation_force" in data:
        data["excitation"] = data.excitation_force
    elif "diffraction_force" in data and "Froude_Krylov_force" in data:
        data["excitation"] = data.diffraction_force + data.Froude_Krylov_force
    elif needed == NEEDED:
        missing.append("excitation_force")
    if missing:
        fix = "compute it in Capytaine (bodies need mass and stiffness) and write the dataset again"
        raise SceneError(f"has no {', '.join(missing)}", file=file, key="bem.file", fix=fix)
    return _along_omega(data, file)


def _along_omega(data, file: Path):
    """The dataset along `omega`, which is a coordinate of `period`, `wavenumber` or such in some; one water depth and no
    forward speed."""
    if "omega" not in data.dims:
        own = data.omega.dims if "omega" in data.coords else ()
        if len(own) != 1:
            raise SceneError("has no omega", file=file, key="bem.file", fix="compute it over several omega")
        data = data.swap_dims({own[0]: "omega"})
    for dim in ("water_depth", "forward_speed", "g", "rho"):
        if dim in data.dims:
            if data.sizes[dim] > 1:
                fix = "select one in Capytaine's dataset and write it again"
                raise SceneError(f"has {data.sizes[dim]} values of {dim}", file=file, key="bem.file", fix=fix)
            data = data.isel({dim: 0})
    data = data.sortby("omega")
    data = data.sel(omega=np.isfinite(data.omega) & (data.omega > 0))
    if not data.sizes["omega"]:
        raise SceneError("has no frequency above zero", file=file, key="bem.file", fix="compute it over several omega")
    return data


def modes(bem: Bem, joints: Sequence[str]) -> Modes:
    """The modes of the joints that a study sets beside the file; `joints` are those of the study. Raises SceneError for one
    that it does not have."""
    single = {bem.joint or str(joints[0]): bem.dof}
    found = {j: {way: 1.0} if isinstance(way, str) else way for j, way in (bem.dofs or single).items()}
    for name in found:
        if name not in list(map(str, joints)):
            key = "bem.dofs" if bem.dofs else "bem.joint"
            raise SceneError(f"no joint {name!r}", key=key, fix=f"the study has {', '.join(map(str, joints))}")
    return found


def transformation(data, ways: Modes, bem: Bem | None = None) -> np.ndarray:
    """T (degrees of freedom of the dataset, joints). Raises SceneError for one that the dataset lacks; `bem` says in which file
    and by which key."""
    dofs = [str(name) for name in data.radiating_dof.values]
    out = np.zeros((len(dofs), len(ways)))
    for n, way in enumerate(ways.values()):
        for dof, factor in way.items():
            if dof not in dofs:
                key, fix = "bem.dofs" if bem and bem.dofs else "bem.dof", f"the dataset has {', '.join(dofs)}"
                raise SceneError(f"no degree of freedom {dof!r}", key=key, file=bem and bem.file, fix=fix)
            out[dofs.index(dof), n] = factor
    return out


def radiated(data, ways: Modes):
    """`added_mass` and `radiation_damping` (omega, driven, joint) of the joints as an `xarray.Dataset`."""
    xarray = require("xarray", "report", "a comparison with linear theory")
    turn, names = transformation(data, ways), list(ways)
    ordered = _ordered(data)
    parts = {
        name: (("omega", "driven", "joint"), np.einsum("ai,wab,bj->wji", turn, _values(ordered[name], True), turn))
        for name in RADIATED
    }
    return xarray.Dataset(parts, coords={"omega": data.omega.values.astype(float), "driven": names, "joint": names})


def _ordered(data):
    dofs = list(data.radiating_dof.values)
    return data.sel({"influenced_dof": dofs, "radiating_dof": dofs})


def _values(matrix, over_omega: bool = False) -> np.ndarray:
    return matrix.transpose(*(("omega",) if over_omega else ()), *MATRIX).values


def responses(data, turn: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Complex motions (omega, joints) per metre of wave amplitude, exp(-i omega t), for waves of heading 0; damping and
    stiffness (joints,) of the power take-offs, SI."""
    data = _ordered(data)
    if "wave_direction" in data.dims:
        if abs(data.wave_direction.values).min() > 1e-6:
            fix = "compute wave_direction = 0 in Capytaine too"
            raise SceneError("has no waves of heading 0, those of a flume", key="bem.file", fix=fix)
        data = data.sel(wave_direction=0.0, method="nearest")
    added, lost = (turn.T @ _values(data[n], True) @ turn for n in RADIATED)
    inertia, spring = (turn.T @ _values(data[n]) @ turn for n in ("inertia_matrix", "hydrostatic_stiffness"))
    force = data.excitation.transpose("omega", "influenced_dof").values @ turn
    w = data.omega.values.astype(float)[:, None, None]
    left = -(w**2) * (inertia + added) - 1j * w * (lost + np.diag(damping)) + spring + np.diag(stiffness)
    return np.linalg.solve(left, force[..., None])[..., 0]


def rao(data, dof: str, damping: float = 0.0, stiffness: float = 0.0):
    """Complex RAO of a degree of freedom over `omega`: the whole system of the dataset solved, with damping and stiffness of
    the power take-off on `dof` (SI)."""
    xarray = require("xarray", "report", "a comparison with linear theory")
    at = transformation(data, {dof: {dof: 1.0}})[:, 0]
    motion = responses(data, np.eye(len(at)), damping * at, stiffness * at) @ at
    return xarray.DataArray(motion, dims="omega", coords={"omega": data.omega.values.astype(float)})


def compare(results, bem: Bem):
    """The dataset of a RAO study with `rao_bem`, `rao_phase_bem` (lead over the crest at the body [rad]) and `rao_ratio` (run
    over linear theory) at its own parameters, along `joint`, and `rao_theory` over all frequencies `bem_omega` of the file.
    Joints without a degree of freedom, and frequencies outside those of the file, are NaN."""
    xarray = require("xarray", "report", "a comparison with linear theory")
    name = frequency_name(results)
    joints = list(map(str, results.joint.values))
    ways, data = modes(bem, joints), read_bem(bem.file)
    level = bem.damping if isinstance(bem.damping, str) else None
    if level and level not in results.coords:
        fix = "name one, or give a number"
        raise SceneError(f"the study has no parameter {level!r}", key="bem.damping", fix=fix)
    dampings = results[level].values.astype(float) if level else np.array([float(bem.damping)])
    motion = np.full((len(dampings), data.sizes["omega"], len(joints)), np.nan + 0j)
    for n, damping in enumerate(dampings):
        for joint, values in _of_joints(data, bem, ways, damping).items():
            motion[n, :, joints.index(joint)] = values
    dims, coords = ("level", "omega", "joint"), {"omega": data.omega.values.astype(float), "joint": joints}
    curves = xarray.DataArray(motion, dims=dims, coords=coords)
    curves = curves.rename(level=level) if level else curves.isel(level=0)
    at = curves.interp(omega=as_omega(results[name].values, name)).rename(omega=name)
    units = results.rao.attrs["units"]
    results["rao_bem"] = at.dims, abs(at.values), {"units": units, "long_name": "RAO, linear potential theory"}
    facts = {"units": "rad", "long_name": "phase, linear potential theory"}
    results["rao_phase_bem"] = at.dims, -np.angle(at.values), facts
    results["rao_ratio"] = results.rao / results.rao_bem
    results["rao_ratio"].attrs = {"units": "1", "long_name": "RAO over linear theory"}
    dense = curves.rename(omega="bem_omega")
    results["rao_theory"] = dense.dims, abs(dense.values), results.rao_bem.attrs
    return _with_omega(results, data)


def _of_joints(data, bem: Bem, ways: Modes, damping: float) -> dict[str, np.ndarray]:
    """Joint -> complex motion (omega,). With `dof` the whole system of the file moves, with `dofs` the joints named alone."""
    if not bem.dofs:
        [joint] = ways
        return {joint: rao(data, bem.dof, damping, bem.stiffness).values}
    taken = np.array([name == (bem.joint or next(iter(ways))) for name in ways], float)
    motion = responses(data, transformation(data, ways), damping * taken, bem.stiffness * taken)
    return dict(zip(ways, motion.T, strict=True))


def compare_power(results, bem: Bem, waves):
    """The dataset of a power matrix study with `power_matrix_bem` [W], the mean power that the power take-off absorbs by linear
    theory: c/2 omega^2 |X|^2 (H/2)^2 in regular waves, c integral omega^2 |X|^2 S(omega) d omega in a sea of the spectrum of
    `waves`, those of the study's scene; and `power_matrix_ratio`, runs over theory. NaN where the file's frequencies hold less
    than `COVERED` of the waves' energy."""
    from cases.report.wave_figures import energy_period_ratio

    [period] = set(results.power_matrix.dims) & PERIODS
    [height] = set(results.power_matrix.dims) & HEIGHTS
    data = read_bem(bem.file)
    ways = modes(bem, list(map(str, results.joint.values)) if "joint" in results.coords else [bem.joint])
    taken = bem.joint or next(iter(ways))
    omega = data.omega.values.astype(float)
    response = (
        bem.damping * (omega * abs(_of_joints(data, bem, ways, bem.damping)[taken])) ** 2
    )  # W for 1 m of amplitude
    ratio = energy_period_ratio(waves) if period == "Te" else 1.0
    per_square = [  # W for 1 m of height
        _regular(response, omega, T) if waves.kind == "regular" else _sea(response, omega, T / ratio, waves)
        for T in results[period].values.astype(float)
    ]
    power = results[height].astype(float) ** 2 * results[period].copy(data=per_square)
    power = power.transpose(*results.power_matrix.dims)
    facts = {"units": "W", "long_name": "mean absorbed power, linear theory"}
    results["power_matrix_bem"] = power.dims, power.values, facts
    results["power_matrix_ratio"] = results.power_matrix / results.power_matrix_bem
    results["power_matrix_ratio"].attrs = {"units": "1", "long_name": "mean absorbed power over that of linear theory"}
    return results


def check_file(bem: Bem, routine: str) -> None:
    """Raises SceneError where the file lacks what the routine needs, or a degree of freedom, before anything is run."""
    data = read_bem(bem.file, RADIATED if routine == "radiation" else NEEDED)
    transformation(data, modes(bem, list(bem.dofs) or [bem.joint]), bem)


def check_generator(bem: Bem, scene, driven: Sequence[str]) -> None:
    """Raises SceneError where the power take-off that the scene has on the joint is another than that of linear theory;
    `driven` are the keys that the study's parameters set."""
    joint = bem.joint or next(iter(bem.dofs), "")
    for name, body in scene.bodies.items():
        pto = body.pto if hasattr(body.pto, "kind") else (body.pto or {}).get(joint)
        if pto is None or getattr(pto, "kind", "") != "linear":
            continue
        for what in ("damping", "stiffness"):
            key, given, own = f"bodies.{name}.pto", getattr(bem, what), getattr(pto, what)
            set_apart = any(one.startswith(key) and one.endswith(what) for one in driven)
            if not (isinstance(given, str) or set_apart or math.isclose(given, own, rel_tol=1e-6)):
                fault = f"{given:g}, where the scene's {key} has a {what} of {own:g}"
                raise SceneError(fault, key=f"bem.{what}", fix=f"set it to {own:g}, or {key} by [set]")


def check_power(bem: Bem, waves, names: Sequence[str]) -> None:
    """Raises SceneError where linear theory has no power matrix for these parameters of a study, or for waves of this kind."""
    kind = getattr(waves, "kind", None)
    if kind not in SEAS or set(names) - HEIGHTS - PERIODS - {"seed"}:
        fix = f"let the matrix be over height and period of {' or '.join(SEAS)} waves alone, or remove [bem]"
        raise SceneError("linear theory has no power for this matrix", key="bem", fix=fix)
    if isinstance(bem.damping, str):
        raise SceneError("a power matrix has one damping", key="bem.damping", fix="give a number")


def _regular(response: np.ndarray, omega: np.ndarray, period: float) -> float:
    at = 2 * math.pi / period
    return float(np.interp(at, omega, response, np.nan, np.nan)) / 8  # amplitude H/2, mean of a sine's square


def _sea(response: np.ndarray, omega: np.ndarray, peak_period: float, waves) -> float:
    """Of a sea with Hm0 = 1 m: its m0 is 1/16 m2."""
    from fsi.waves.kinds.irregular import LOWEST, spectrum

    gamma = 1.0 if waves.spectrum == "pierson_moskowitz" else waves.gamma or 3.3
    f = np.linspace(LOWEST, waves.highest, 2001) / peak_period
    share = spectrum(f, 1 / peak_period, gamma)
    share /= share.sum()
    at = np.interp(2 * math.pi * f, omega, response, np.nan, np.nan)
    known = np.isfinite(at)
    return float(share[known] @ at[known]) / 16 if share[known].sum() >= COVERED else math.nan


def compare_radiation(results, bem: Bem):
    """The dataset of a radiation study with `added_mass_theory` and `radiation_damping_theory` (driven, bem_omega, joint) of
    the file, and both at the study's own frequencies as `added_mass_bem` and `radiation_damping_bem`."""
    joints = list(map(str, results.joint.values))
    driven = (
        list(map(str, results.driven.values)) if "driven" in results.dims else [results.attrs.get("driven", joints[0])]
    )
    theory = radiated(read_bem(bem.file, RADIATED), modes(bem, joints)).reindex(driven=driven, joint=joints)
    if "driven" not in results.dims:
        theory = theory.isel(driven=0, drop=True)
    name = frequency_name(results)
    at = theory.interp(omega=as_omega(results[name].values, name)).rename(omega=name)
    for key in RADIATED:
        facts = {"units": results[key].attrs["units"], "long_name": f"{results[key].attrs['long_name']}, linear theory"}
        results[f"{key}_bem"] = at[key].dims, at[key].values, facts
        dense = theory[key].rename(omega="bem_omega")
        results[f"{key}_theory"] = dense.dims, dense.values, facts
    return _with_omega(results, theory)


def _with_omega(results, data):
    facts = {"units": "rad/s", "long_name": "frequency of the file of linear theory"}
    return results.assign_coords(bem_omega=("bem_omega", data.omega.values.astype(float), facts))


def frequency_name(results) -> str:
    """What the study calls its frequency."""
    return next(n for n in ("period", "omega", "frequency") if n in results.coords)


def as_omega(values, name: str) -> np.ndarray:
    """Angular frequency [rad/s] of what a study calls `period` [s], `frequency` [Hz] or `omega`."""
    values = np.asarray(values, float)
    return {"period": 2 * math.pi / values, "frequency": 2 * math.pi * values, "omega": values}[name]


def of_omega(omega, name: str) -> np.ndarray:
    """What a study calls so, of angular frequencies [rad/s]."""
    omega = np.asarray(omega, float)
    return {"period": 2 * math.pi / omega, "frequency": omega / (2 * math.pi), "omega": omega}[name]
