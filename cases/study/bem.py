"""A RAO beside linear theory: reads the netCDF datasets of Capytaine (Ancellin & Dias 2019) and solves the equation of
motion with them.

Capytaine's fields vary as exp(-i omega t), so that (-omega^2 (M + A) - i omega (B + b) + K + k) X = F for the motion X of
a wave of unit amplitude whose crest is at the origin at t = 0; b and k are damping and stiffness of the power take-off.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.study.plan import Bem
from fsi.errors import SceneError
from fsi.extras import require
from fsi.trust import check_bytes

MOST_BYTES = 1e9  # of a dataset
NEEDED = ("added_mass", "radiation_damping", "inertia_matrix", "hydrostatic_stiffness")


def read_bem(file: Path):
    """The dataset of a file with complex numbers put together (Capytaine writes them along `complex`: re, im) and the
    sum of Froude-Krylov and diffraction force as `excitation`. Raises SceneError where something is missing."""
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
    missing = [name for name in NEEDED if name not in data]
    if "excitation_force" in data:
        data["excitation"] = data.excitation_force
    elif "diffraction_force" in data and "Froude_Krylov_force" in data:
        data["excitation"] = data.diffraction_force + data.Froude_Krylov_force
    else:
        missing.append("excitation_force")
    if missing:
        fix = "compute it in Capytaine (bodies need mass and stiffness) and write the dataset again"
        raise SceneError(f"has no {', '.join(missing)}", file=file, key="bem.file", fix=fix)
    return data


def rao(data, dof: str, damping: float = 0.0, stiffness: float = 0.0):
    """Complex RAO of a degree of freedom over `omega`, per metre of amplitude, exp(-i omega t), for waves of heading 0:
    the whole system of the dataset solved, with damping and stiffness of the power take-off on `dof` (SI)."""
    xarray = require("xarray", "report", "a comparison with linear theory")
    dofs = [str(name) for name in data.radiating_dof.values]
    if dof not in dofs:
        raise SceneError(f"no degree of freedom {dof!r}", key="bem.dof", fix=f"the dataset has {', '.join(dofs)}")
    order = {"influenced_dof": dofs, "radiating_dof": dofs}
    data = (
        data.sel(order).sel(wave_direction=0.0, method="nearest") if "wave_direction" in data.dims else data.sel(order)
    )
    matrix = ("influenced_dof", "radiating_dof")
    added, radiated = (data[n].transpose("omega", *matrix).values for n in ("added_mass", "radiation_damping"))
    inertia, spring = (data[n].transpose(*matrix).values for n in ("inertia_matrix", "hydrostatic_stiffness"))
    force = data.excitation.transpose("omega", "influenced_dof").values
    at = np.zeros((len(dofs), len(dofs)))
    at[dofs.index(dof), dofs.index(dof)] = 1.0
    omega = data.omega.values.astype(float)
    w = omega[:, None, None]
    left = -(w**2) * (inertia + added) - 1j * w * (radiated + damping * at) + spring + stiffness * at
    motion = np.linalg.solve(left, force[..., None])[:, dofs.index(dof), 0]
    return xarray.DataArray(motion, dims="omega", coords={"omega": omega})


def compare(results, bem: Bem):
    """The dataset of a RAO study with `rao_bem`, `rao_phase_bem` (lead over the crest at the body [rad]) and `rao_ratio`
    (run over linear theory) at its own parameters. Frequencies outside those of the file are NaN."""
    name = next(n for n in ("period", "omega", "frequency") if n in results.coords)
    joint = bem.joint or str(results.joint.values[0])
    data = read_bem(bem.file)
    damping_dim = bem.damping if isinstance(bem.damping, str) else None
    if damping_dim and damping_dim not in results.coords:
        raise SceneError(
            f"the study has no parameter {damping_dim!r}", key="bem.damping", fix="name one, or give a number"
        )
    omega = as_omega(results[name].values, name)
    levels = results[damping_dim].values.astype(float) if damping_dim else [float(bem.damping)]
    curves = []
    for damping in levels:
        exact = rao(data, bem.dof, damping, bem.stiffness)
        curves.append(exact.interp(omega=omega).values)
    dims = (damping_dim, name) if damping_dim else (name,)
    values = np.array(curves) if damping_dim else curves[0]
    units = results.rao.attrs["units"]
    results["rao_bem"] = dims, abs(values), {"units": units, "long_name": "RAO, linear potential theory"}
    results["rao_phase_bem"] = dims, -np.angle(values), {"units": "rad", "long_name": "phase, linear potential theory"}
    results["rao_ratio"] = results.rao.sel(joint=joint, drop=True) / results.rao_bem
    results["rao_ratio"].attrs = {"units": "1", "long_name": "RAO over linear theory"}
    return results


def as_omega(values, name: str) -> np.ndarray:
    """Angular frequency [rad/s] of what a study calls `period` [s], `frequency` [Hz] or `omega`."""
    values = np.asarray(values, float)
    return {"period": 2 * math.pi / values, "frequency": 2 * math.pi * values, "omega": values}[name]
