"""How often which sea occurs in a year, and what a converter with a power matrix makes of it.

A scatter table is a CSV file, either with a line for each sea under a header of three names, `Hs,Tp,occurrence`, or as a
matrix: heights down the first column, periods along the header, whose first cell names both, such as `Hs/Te`. The period is
`Tp` of the peak or `Te` of the energy; the heights are in m, the periods in s; the occurrences may be hours, counts or shares.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsi.errors import SceneError
from fsi.trust import check_bytes

HOURS = 8766.0  # of a year
MOST_BYTES = 1e7
HEIGHTS, PERIODS = ("hs", "hm0"), ("tp", "te")
FIX = "write a line Hs,Tp,occurrence and one for each sea, or a matrix whose first cell is Hs/Tp (or Te for energy periods)"


@dataclass(frozen=True)
class Scatter:
    """Seas (n,): height [m], period [s] of the kind `tp` or `te`, share of the year, which sum to one."""

    height: np.ndarray
    period: np.ndarray
    share: np.ndarray
    kind: str


@dataclass(frozen=True)
class Annual:
    """Mean annual energy [Wh], half its 95 % confidence interval from the seeds (nan without), mean power [W]; the share of
    the year, and of its waves' energy, that lies in the matrix. What lies outside adds nothing."""

    energy: float
    error: float
    power: float
    covered: float
    covered_energy: float


def read_scatter(file: str | Path) -> Scatter:
    """The table of a file. Raises SceneError naming file and line."""
    file = Path(file)
    check_bytes(file, MOST_BYTES, "give a scatter table, not a record")
    try:
        with file.open(newline="", encoding="utf-8-sig") as text:
            rows = [[cell.strip() for cell in row] for row in csv.reader(text, delimiter=_delimiter(file)) if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise SceneError(f"cannot be read: {getattr(fault, 'strerror', None) or fault}", file=file, fix=FIX) from None
    words = re.findall(r"[a-z]+0?", " ".join(rows[0]).lower()) if rows else []
    kind = next((name for name in PERIODS if name in words), "")
    if len(rows) < 2 or not kind or not set(HEIGHTS) & set(words):
        raise SceneError("is no scatter table", file=file, fix=FIX)
    first = [re.findall(r"[a-z]+0?", cell.lower()) for cell in rows[0]]
    found = _matrix(rows, file) if set(first[0]) & set(PERIODS) else _lines(rows, first, kind, file)
    height, period, count = found.T
    for name, bad in (("a height", height < 0), ("a period", period <= 0), ("an occurrence", count < 0)):
        if bad.any():
            raise SceneError(f"{name} is {found[np.argmax(bad)][['a height', 'a period', 'an occurrence'].index(name)]:g}",
                             file=file, fix="correct it")  # fmt: skip
    if not count.sum() > 0:
        raise SceneError("no sea occurs", file=file, fix="give occurrences above zero")
    return Scatter(height, period, count / count.sum(), kind)


def _delimiter(file: Path) -> str:
    head = file.open(encoding="utf-8-sig").readline()
    return ";" if head.count(";") > head.count(",") else "," if "," in head else "\t" if "\t" in head else ","


def _lines(rows, heads, kind: str, file: Path) -> np.ndarray:
    columns = [
        next((n for n, words in enumerate(heads) if set(words) & set(names)), None) for names in (HEIGHTS, (kind,))
    ]
    rest = [n for n in range(len(heads)) if n not in columns]
    if None in columns or len(rest) != 1:
        raise SceneError("is no scatter table of three columns", file=file, fix=FIX)
    return np.array(
        [[_number(row, n, line, file) for n in (*columns, rest[0])] for line, row in enumerate(rows[1:], 2)]
    )


def _matrix(rows, file: Path) -> np.ndarray:
    periods = [_number(rows[0], n, 1, file) for n in range(1, len(rows[0]))]
    return np.array(
        [
            (_number(row, 0, line, file), period, _number(row, n, line, file) if n < len(row) and row[n] else 0.0)
            for line, row in enumerate(rows[1:], 2)
            for n, period in enumerate(periods, 1)
        ]
    )


def _number(row, n: int, line: int, file: Path) -> float:
    try:
        value = float(row[n])
    except (IndexError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        shown = repr(row[n]) if n < len(row) else "nothing"
        raise SceneError(
            f"line {line} has {shown} in column {n + 1}, a number belongs there", file=file, fix="correct it"
        )
    return value


def annual(matrix, error, scatter: Scatter, ratio: float | None) -> Annual:
    """What a power matrix (height, period) [W], an `xarray.DataArray`, makes in a year of these seas, bilinear between its own;
    `error` is its standard error or None. `ratio` is Te over Tp of the spectra, needed where table and matrix have different
    periods. Raises SceneError where it is, or where the matrix is no matrix or misses a run."""
    height, period = (str(dim) for dim in matrix.dims) if matrix.ndim == 2 else ("", "")
    if height not in ("Hm0",) or period not in ("Te", "peak_period"):
        fix = "give the study the parameters Hm0 and Te (or peak_period), more than one value each"
        raise SceneError(
            "a scatter table needs a matrix over significant height and period of a sea", key="--scatter", fix=fix
        )
    if min(matrix.shape) < 2:
        raise SceneError("the matrix has a single height or period", key="--scatter", fix="give the study more of them")
    matrix = matrix.sortby([height, period])
    error = None if error is None else error.sortby([height, period])
    seas = scatter.period
    if scatter.kind != {"Te": "te", "peak_period": "tp"}[period]:
        if ratio is None:
            fix = f"give the table {'energy' if period == 'Te' else 'peak'} periods"
            raise SceneError(
                f"the spectrum does not say how {scatter.kind} goes with {period}", key="--scatter", fix=fix
            )
        seas = seas * ratio if scatter.kind == "tp" else seas / ratio
    if not np.isfinite(matrix.values).all():
        raise SceneError(
            "a run of the power matrix is missing", key="--scatter", fix="run the study to its end, with --retry"
        )
    rows, down = _between(matrix[height].values.astype(float), scatter.height)
    columns, along = _between(matrix[period].values.astype(float), seas)
    inside = np.isfinite(down) & np.isfinite(along)
    weight = np.zeros(matrix.shape)  # share of the year of every sea of the matrix
    for i, a in ((0, 1 - down), (1, down)):
        for j, b in ((0, 1 - along), (1, along)):
            np.add.at(weight, (rows[inside] + i, columns[inside] + j), (scatter.share * a * b)[inside])
    power = float((weight * matrix.values).sum())
    spread = math.nan if error is None else 1.96 * float(np.sqrt(((weight * error.values) ** 2).sum()))
    flux = scatter.share * scatter.height**2 * seas
    return Annual(
        HOURS * power, HOURS * spread, power, float(scatter.share[inside].sum()), float(flux[inside].sum() / flux.sum())
    )


def _between(grid: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the interval of an ascending grid and the share of the way through it; nan outside."""
    place = np.clip(np.searchsorted(grid, values, side="right") - 1, 0, len(grid) - 2)
    share = (values - grid[place]) / (grid[place + 1] - grid[place])
    return place, np.where((share >= -1e-9) & (share <= 1 + 1e-9), share, np.nan)
