"""The series of a run as a file for other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.dataset import frames_of
from fsi.record.files import new_file


def export(path: str | Path, to: str = "nc") -> Path:
    """Write the series of a run beside it, as `run.nc` (netCDF 4) or `run.csv`; returns the file, which is whole or not there.

    The CSV has one row a time and one column for each element of each variable, headed e.g. `body_force.flap.x [N]`;
    it leaves the events out. Raises SceneError where the run has no frame, or the file cannot be written.
    """
    dataset = frames_of(path)
    file = Path(path, f"run.{to}")
    if to == "nc":
        for package in ("h5py", "h5netcdf"):
            require(package, "report", "export to netCDF")
    try:
        with new_file(file) as new:
            if to == "nc":
                dataset = dataset.drop_vars("wall_time")  # the same run makes the same file
                dataset.to_netcdf(new, engine="h5netcdf")
            else:
                _write_csv(dataset, new)
    except (OSError, RuntimeError) as fault:  # the second is how HDF5 says that it cannot close a file
        raise SceneError(f"{file} cannot be written: {getattr(fault, 'strerror', None) or fault}") from None
    return file


def _write_csv(dataset, file: Path) -> None:
    heads, columns = ["time [s]"], [dataset["time"].values]
    for name, variable in dataset.data_vars.items():
        if "time" not in variable.dims:
            continue
        names = [list(map(str, dataset[dim].values)) for dim in variable.dims[1:]]
        for index in np.ndindex(variable.shape[1:]):
            label = ".".join([name, *(along[i] for along, i in zip(names, index, strict=True))])
            heads.append(f"{label} [{variable.attrs['units']}]")
            columns.append(variable.values[(slice(None), *index)])
    header = ",".join(f'"{head}"' if "," in head else head for head in heads)
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
