"""The rows of a study as one dataset, on disk as netCDF, and as CSV and Parquet tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases.study.plan import Study, Value
from cases.study.worker import Outcome
from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.files import new_file
from fsi.trust import check_bytes

MOST_BYTES = 2**36  # of a dataset that is read
FILE = "study.nc"


@dataclass
class Row:
    """A point of a study and what came of it; `run` is the hash that names its folder, empty where there is none."""

    values: dict[str, Value]
    run: str
    outcome: Outcome


def dataset(study: Study, rows: Sequence[Row]):
    """The rows as an `xarray.Dataset`: on the grid of the parameters, or along `run` where they form none.

    Parameters are coordinates, figures variables, both with `units` and `long_name`; figures of joints, bodies, gauges
    and probes have that dimension too. Points that failed are NaN, with `status` and `reason`.
    """
    xarray = require("xarray", "report", "a study")
    dims, sizes, places = _frame(study, rows)
    data = xarray.Dataset(attrs=_attributes(study))
    for name, parameter in study.parameters.items():
        along = parameter.grid() if dims != ("run",) else [row.values[name] for row in rows]
        facts = {"units": parameter.units or "1", "long_name": parameter.description or name, "key": parameter.key}
        data = data.assign_coords({name: (name if dims != ("run",) else "run", np.array(along), facts)})
    for name, texts in (
        ("status", [row.outcome.status for row in rows]),
        ("reason", [row.outcome.reason for row in rows]),
        ("run_hash", [row.run for row in rows]),
    ):
        values = np.full(sizes, "", dtype=object)
        for place, text in zip(places, texts, strict=True):
            values[place] = text
        data[name] = dims, values.astype(str), {"units": "1", "long_name": name.replace("_", " ")}
    for name, variable in _figures(rows, sizes, places).items():
        label_dim, labels, values, facts = variable
        data[name] = (*dims, *label_dim), values, facts
        if label_dim:
            data = data.assign_coords({label_dim[0]: labels})
    return data


def _frame(study: Study, rows: Sequence[Row]) -> tuple[tuple[str, ...], tuple[int, ...], list[tuple[int, ...]]]:
    """Dimensions, their sizes, and the place of every row."""
    if study.sampling.method != "grid" or not study.parameters:
        return ("run",), (len(rows),), [(n,) for n in range(len(rows))]
    grids = {name: parameter.grid() for name, parameter in study.parameters.items()}
    places = [tuple(grids[name].index(row.values[name]) for name in grids) for row in rows]
    return tuple(grids), tuple(map(len, grids.values())), places


def _figures(rows: Sequence[Row], sizes, places) -> dict:
    """Figure name -> its dimension beside the parameters, labels along it, values, attributes."""
    labels: dict[str, list[str]] = {}
    kinds: dict[str, tuple[str, str, str]] = {}
    for row in rows:
        for name, _, units, long_name, dim, label in (row.outcome.figures or {}).values():
            kinds.setdefault(name, (dim, units, long_name))
            if dim and label not in labels.setdefault(dim, []):
                labels[dim].append(label)
    out = {}
    for name, (dim, units, long_name) in kinds.items():
        values = np.full((*sizes, len(labels[dim])) if dim else sizes, np.nan)
        for place, row in zip(places, rows, strict=True):
            for figure, value, _, _, _, label in (row.outcome.figures or {}).values():
                if figure == name:
                    values[(*place, labels[dim].index(label)) if dim else place] = value
        out[name] = (dim,) if dim else (), labels.get(dim, []), values, {"units": units, "long_name": long_name}
    return out


def _attributes(study: Study) -> dict:
    facts = {"study": study.name, "method": study.sampling.method, "routine": study.routine or ""}
    if study.objective:
        facts |= {"objective": study.objective.figure, "sense": study.objective.sign}
    limits = {name: bounds.model_dump(exclude_none=True) for name, bounds in study.constraints.items()}
    return facts | {"constraints": json.dumps(limits), "description": study.description}


def write(data, folder: Path) -> Path:
    """The dataset as `study.nc` in the folder, replaced in one go."""
    require("h5netcdf", "report", "the dataset of a study")
    file = folder / FILE
    try:
        with new_file(file) as new:
            data.to_netcdf(new, engine="h5netcdf")
    except (OSError, RuntimeError) as fault:  # the second is how HDF5 says that it cannot close a file
        raise SceneError(
            f"{file} cannot be written: {getattr(fault, 'strerror', None) or fault}", key="--out"
        ) from None
    return file


def load_results(folder: str | Path):
    """The dataset of a study's folder. Raises SceneError where it holds none."""
    xarray = require("xarray", "report", "a study")
    file = Path(folder, FILE)
    if not file.is_file():
        raise SceneError(
            f"{folder} holds no study and no run", fix="give the folder that `fsi sweep` or `fsi run` named"
        )
    check_bytes(file, MOST_BYTES, "give the folder of a smaller study")
    with xarray.open_dataset(file, engine="h5netcdf") as data:
        return data.load()


def table(data):
    """One row a point, one column a parameter or figure, as a `pandas.DataFrame`; columns of joints, bodies, gauges and
    probes are named e.g. `force_max.flap`. `attrs` maps every column to its units."""
    pandas = require("pandas", "report", "a table")
    from itertools import product

    names = {name for name, coord in data.coords.items() if "key" in coord.attrs}
    own = [dim for dim in data.dims if dim == "run" or dim in names]
    flat = data.stack(point=own) if own else data.expand_dims("point")
    columns, units = {}, {}
    for name in [*names_in_order(data), *data.data_vars]:
        variable = flat[name]
        if "bem_omega" in variable.dims:  # a curve, not a figure of the runs
            continue
        extra = [dim for dim in variable.dims if dim != "point"]
        for index in product(*(range(variable.sizes[dim]) for dim in extra)):
            at = dict(zip(extra, index, strict=True))
            label = ".".join([name, *(str(data[dim].values[i]) for dim, i in at.items())])
            columns[label] = variable.isel(at).values
            units[label] = data[name].attrs.get("units", "1")
    frame = pandas.DataFrame(columns)
    frame.attrs["units"] = units
    return frame


def names_in_order(data) -> list[str]:
    """The parameters of a dataset, in the order of the study."""
    return [str(name) for name, coord in data.coords.items() if "key" in coord.attrs]


def export(data, folder: Path, to: str) -> Path:
    """Write the table of a study as `study.csv`, its heads with units, or as `study.parquet`, with units in the metadata
    of each column."""
    frame, file = table(data), folder / f"study.{to}"
    units = frame.attrs["units"]
    if to == "csv":
        with new_file(file) as new:
            frame.rename(columns={name: f"{name} [{units[name]}]" for name in frame}).to_csv(new, index=False)
        return file
    pyarrow = require("pyarrow", "study", "a Parquet file")
    parquet = require("pyarrow.parquet", "study", "a Parquet file")
    frame.attrs = {}
    arrow = pyarrow.Table.from_pandas(frame, preserve_index=False)
    fields = [field.with_metadata({"units": units[field.name]}) for field in arrow.schema]
    with new_file(file) as new:
        parquet.write_table(arrow.cast(pyarrow.schema(fields, metadata=arrow.schema.metadata)), new)
    return file
