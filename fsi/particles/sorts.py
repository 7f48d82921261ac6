"""The sort that a grid needs."""

from __future__ import annotations

from fsi.compute.team import Team
from fsi.particles.cells import CellSort, Grid


def make_sort(grid: Grid, team: Team) -> CellSort:
    """A sort into the cells of a grid, and where it is compact one that gives the same order and keeps only the cells that hold
    particles. Sorts that are searched together stand on one grid."""
    if not grid.compact:
        return CellSort(grid, team)
    from fsi.particles.compact_cells import CompactSort

    return CompactSort(grid, team)
