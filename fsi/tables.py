"""Tables that a user gives as text: two columns under one header line, and what is wrong with them by row and column."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from fsi.errors import SceneError
from fsi.trust import check_bytes

MOST_BYTES = 2e8  # of a table's text; 10 million rows
UNIT = re.compile(r"[\[(]\s*([^\W\d]+|°)(?:\s*/\s*s)?\s*[\])]")  # in a head such as `position [mm]`
OTHER_UNITS = {
    "ms",
    "us",
    "min",
    "h",
    "hr",
    "mm",
    "cm",
    "dm",
    "km",
    "in",
    "inch",
    "ft",
    "deg",
    "degree",
    "degrees",
    "°",
}
OTHER_UNITS |= {"khz", "rpm", "kn", "kgf", "lbf", "mn", "knm"}


def read_table(file: Path, columns: Sequence[str], least: int) -> np.ndarray:
    """Numbers (rows, columns) of a comma-separated file with one header line, the first column increasing from row to row.

    columns: their names, for messages; least: rows at least. Raises SceneError with row and column, rows counted as lines of
    the file.
    """
    fix = f"give {' and '.join(columns)} in comma-separated columns under one header line, sorted by {columns[0]}"
    try:
        check_bytes(file, MOST_BYTES, "give fewer rows")
        text = file.read_text(encoding="utf-8-sig")
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=file, fix=fix) from None
    except UnicodeDecodeError:
        raise SceneError("is not UTF-8 text", file=file, fix="save it as CSV in UTF-8") from None
    lines = text.splitlines()
    rows = _parse(lines, len(columns))
    fault = next(_faults(lines, rows, columns, least), None)
    if fault:
        raise SceneError(fault, file=file, fix=fix)
    return rows


def _parse(lines: Sequence[str], columns: int) -> np.ndarray | None:
    """The numbers under the header, None where there is something else."""
    try:
        with warnings.catch_warnings(action="ignore"):  # of an empty table
            rows = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
    except ValueError:
        return None
    return rows if rows.shape[1] == columns else None


def _faults(lines: Sequence[str], rows: np.ndarray | None, columns: Sequence[str], least: int) -> Iterator[str]:
    filled = [number for number, line in enumerate(lines, 1) if _content(line)]
    if not filled:
        yield "is empty"
        return
    heads = lines[0].split(",")
    if all(map(_is_number, heads)):
        yield f"row 1: has numbers, {lines[0].strip()!r}, where a header line belongs"
    for name, head in zip(columns, heads, strict=False):
        if (unit := UNIT.search(head)) and unit[1].lower() in OTHER_UNITS:
            yield f"row 1, column {name}: is in {unit[1]}, and is read in units of the SI (m, s, rad, Hz, N); convert it"
    if rows is None:
        for number in filled[filled[0] == 1 :]:
            yield from _odd(number, _content(lines[number - 1]).split(","), columns)
    if rows is None or len(rows) < least:
        count = len(filled) - (filled[0] == 1)
        yield f"has {count} row{'s' * (count != 1)} of numbers under its header, and needs {least} or more"
        return
    numbers = filled[filled[0] == 1 :]  # of the lines that hold the rows
    for row, column in np.argwhere(~np.isfinite(rows)):
        yield f"row {numbers[row]}, column {columns[column]}: {rows[row, column]} is not a finite number"
    for row in np.flatnonzero(np.diff(rows[:, 0]) <= 0) + 1:
        now, before = rows[row, 0], rows[row - 1, 0]
        yield f"row {numbers[row]}, column {columns[0]}: {now:.12g} does not lie above {before:.12g} of the row before"


def _odd(number: int, cells: Sequence[str], columns: Sequence[str]) -> Iterator[str]:
    """What keeps a line from being a row of the table."""
    line = ",".join(cells)
    if len(cells) != len(columns):
        for name, sign in (("semicolons", ";"), ("tabs", "\t")):
            if sign in line:
                yield f"row {number}: {line!r} has its columns between {name}; use commas, and points in decimals"
        yield f"row {number}: has {len(cells)} column{'s' * (len(cells) != 1)}, {line[:60]!r}, where {len(columns)} belong"
    for name, cell in zip(columns, cells, strict=False):
        if not _is_number(cell):
            yield f"row {number}, column {name}: {cell.strip()[:60]!r} is not a number"


def _content(line: str) -> str:
    """A line without its comment, as numpy reads it."""
    return line.partition("#")[0].strip("\r\n ")


def _is_number(text: str) -> bool:
    try:
        float(text)
        return True
    except ValueError:
        return False
