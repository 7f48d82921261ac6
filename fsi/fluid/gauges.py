"""Wave gauges and pressure probes: what an instrument at a fixed place would read."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fsi.compute.jit import exact
from fsi.sph.kernel import value
from fsi.sph.terms import kernel

FILLED = 0.5  # share of the room in the kernel's support that is fluid at the free surface
ROOM = 0.2  # share of the support outside solids, below which a place is inside one; in a vertical corner it is 0.25
ASIDE = 0.05  # spacings by which the middle of the room may lie aside before the slope of the surface counts


@exact
def _column(position, point, reach, period, spans):
    """Horizontal offsets and height (dim, n) of the particles in `spans` (m, 2), first and end, that are within reach of the
    vertical through the point; the nearest image along an axis with a period."""
    dim, most, count = position.shape[1], 0, 0
    for s in range(spans.shape[0]):
        most += spans[s, 1] - spans[s, 0]
    found = np.empty((dim, most))
    for s in range(spans.shape[0]):
        for i in range(spans[s, 0], spans[s, 1]):
            r2 = 0.0
            for d in range(dim - 1):
                x = position[i, d] - point[d]
                if period[d] > 0:
                    x -= period[d] * round(x / period[d])
                found[d, count] = x
                r2 += x * x
            if r2 < reach * reach:
                found[dim - 1, count] = position[i, dim - 1]
                count += 1
    return found[:, :count]


@exact
def _share(column, z, h, cell_over_h, moment):
    """Share of the kernel's support around height z that particles fill, sum W V; cell_over_h is V alpha. The same
    weighted by their offsets goes into `moment` (dim - 1,)."""
    axes, total = column.shape[0] - 1, 0.0
    moment[:] = 0.0
    for i in range(column.shape[1]):
        r2 = (column[axes, i] - z) ** 2
        for d in range(axes):
            r2 += column[d, i] ** 2
        t = 1 - 0.5 * math.sqrt(r2) / h
        if t > 0:
            w = kernel(t) * cell_over_h
            total += w
            for d in range(axes):
                moment[d] += w * column[d, i]
    return total


@exact
def _surface(fluid, solid, spacing, h, cell_over_h, middle):
    """Height of the free surface between the particles of two columns; puts the offset of the middle of the room that the
    solids leave there into `middle` (dim - 1,)."""
    axes = fluid.shape[0] - 1
    if fluid.shape[1] == 0:
        return math.nan
    step, bottom = 0.5 * spacing, fluid[axes].min() - 0.5 * spacing
    low, above, air = fluid[axes].max() + 2 * h, 0.0, False
    aside = np.empty(axes)
    while low > bottom:
        low -= step
        room = 1.0 - _share(solid, low, h, cell_over_h, middle)
        if room < ROOM:
            air = False
            continue
        here = _share(fluid, low, h, cell_over_h, aside) / room
        if here < FILLED:
            above, air = here, True
        elif air:
            middle /= -room
            return low + step * (here - FILLED) / (here - above)
    return math.nan


def elevation(position, point, spacing: float, h: float, solid=None, *, period=None, spans=None) -> float:
    """Height z [m] of the free surface on the vertical through `point` (dim - 1,), nan where there is none.

    It is the highest place under air where fluid at `position` (n, dim) fills half of the room that the boundary particles
    `solid` (b, dim) leave in the kernel's support. Where they leave it to one side only, as at a wall, that is the height
    in the middle of that side; it is carried to the point along the slope of the surface. `period` (dim - 1,): lengths
    after which the fluid repeats itself, 0 for none; `spans`: see `Columns`.
    """
    point, dim = np.asarray(point, float), position.shape[1]
    period = np.zeros(dim - 1) if period is None else period
    solid = np.empty((0, dim)) if solid is None else solid
    around = spans or (lambda _: (_all(position), _all(solid)))

    def measured(place) -> tuple[float, np.ndarray]:
        """Height, and where it is the surface's."""
        middle = np.zeros(dim - 1)
        wet, dry = around(place)
        columns = (
            _column(position, place, 2 * h, period, wet),
            _column(solid, place, 2 * h, np.zeros(dim - 1), dry),
        )
        return _surface(*columns, spacing, h, _peak(spacing, h, dim), middle), middle

    z, middle = measured(point)
    aside = float(np.linalg.norm(middle))
    if not aside > ASIDE * spacing:
        return z
    away = middle / aside
    next_z, next_middle = measured(point + 2 * h * away)
    run = 2 * h + float(next_middle @ away) - aside
    if not (math.isfinite(next_z) and run > h and abs(next_z - z) < run):
        return z
    return z - aside * (next_z - z) / run


def _all(position) -> np.ndarray:
    return np.array([[0, len(position)]])


class Surface:
    """The free surface of a fluid among its boundary particles: `surface(point)` is `elevation` there. It looks at the
    particles in the cells around the vertical alone, sorted as in the last step, in which none went farther than a cell."""

    def __init__(self, fluid):
        self._fluid, self._length = fluid, _period(fluid.scene.tank)

    def __call__(self, point) -> float:
        fluid, solids, h = self._fluid, self._fluid.solids, self._fluid.scene.reading_length
        (position,) = fluid.reductions.around(np.asarray(point, float), 4 * h, fluid.position)
        if position is not fluid.position:  # of several processes
            solid = fluid.boundary_around(point, 4.05 * h)
            return elevation(position, point, fluid.mean_spacing, h, solid, period=self._length)
        solid = solids.position[: solids.count] if solids.count else fluid.boundary
        repeats = self._length.any()
        position = position[fluid.particles.own] if repeats else position  # without the ghosts of the first frame

        def spans(place) -> tuple[np.ndarray, np.ndarray]:
            wet = _all(position) if repeats else _around(fluid.sort, len(position), place)
            return wet, _around(solids.sort, len(solid), place)

        return elevation(position, point, fluid.mean_spacing, h, solid, period=self._length, spans=spans)


def row_reading(position, point, spacing: float, surface: float) -> float:
    """Height z [m] of the free surface at `point` (dim - 1,) as the mean height of the particles within a spacing of its
    vertical and of the surface, which is where `elevation` has it, plus half a spacing: the particles fill the room around
    their centres. nan where there are none."""
    aside = ((position[:, :-1] - np.asarray(point)) ** 2).sum(1) < spacing**2
    row = position[aside & (np.abs(position[:, -1] - surface) < spacing), -1]
    return float(row.mean()) + 0.5 * spacing if row.size else math.nan


def points_reading(position, point, spacing: float, h: float) -> float:
    """Height z [m] of the free surface at `point` (dim - 1,) on a line of points, half a spacing from one to the next: where
    the interpolated share of fluid, sum W V, falls below a half between two of them, without regard to walls; nan where it
    nowhere reaches it."""
    return elevation(position, point, spacing, h)


def _period(tank) -> np.ndarray:
    """Lengths (dim - 1,) after which the fluid of a tank repeats itself [m], 0 for none."""
    sides = zip(tank.axes, tank.min, tank.max, strict=True)
    return np.array([(high - low) * (axis in tank.periodic) for axis, low, high in sides])[:-1]


def dry_gauges(scene, position, boundary) -> list[str]:
    """What to say of the scene's gauges that read nan, for fluid at `position` (n, dim) and boundary particles (b, dim)."""
    feet = {name: (g.x,) if scene.dimension == 2 else (g.x, g.y) for name, g in scene.gauges.items()}
    where = {"spacing": scene.spacing, "h": scene.reading_length, "solid": boundary, "period": _period(scene.tank)}
    dry = [name for name, foot in feet.items() if math.isnan(elevation(position, foot, **where))]
    if not dry:
        return []
    return [f"gauges {', '.join(dry)}: no free surface there at the start, dry or through a solid: nan until one comes"]


def _around(sort, count: int, place: np.ndarray) -> np.ndarray:
    """Spans (m, 2) of the sorted particles in the cells around a vertical; of all where they are not sorted."""
    grid = sort.grid
    if len(sort.start) == 0 or sort.inside != count:
        return np.array([[0, count]])
    axes = len(place)
    side, shape = np.resize(grid.cell, 2)[:axes], np.array(grid.shape[:axes])
    reach = (grid.domain_min - grid.lower)[:axes] + side  # the pad is the kernel's support or more
    first = np.clip(((place - reach - grid.lower[:axes]) / side).astype(int), 0, shape - 1)
    last = np.clip(((place + reach - grid.lower[:axes]) / side).astype(int), 0, shape - 1)
    if grid.compact:
        return sort.around(first, last)
    if axes == 1:
        pencils = np.arange(grid.shape[1]) * shape[0]
    else:
        across = np.arange(first[1], last[1] + 1)
        pencils = ((np.arange(grid.shape[2])[:, None] * shape[1] + across) * shape[0]).ravel()
    return np.stack([sort.start[pencils + first[0]], sort.start[pencils + last[0] + 1]], axis=1).astype(np.int64)


@cache
def _peak(spacing: float, h: float, dim: int) -> float:
    """V W(0): share of the support that a particle fills by itself."""
    return spacing**dim * float(value(0.0, h, dim))


@exact
def _mean_pressure(position, pressure, point, h, rho_g):
    last, total, sum_, over = position.shape[1] - 1, 0.0, 0.0, False
    for i in range(position.shape[0]):
        r2 = 0.0
        for d in range(last + 1):
            r2 += (position[i, d] - point[d]) ** 2
        if r2 < 4 * h * h:
            weight = kernel(1 - 0.5 * math.sqrt(r2) / h)
            total += weight
            sum_ += weight * (pressure[i] + rho_g * (position[i, last] - point[last]))
            over = over or position[i, last] > point[last]
    return sum_ / total if total > 0 and (over or sum_ > 0) else 0.0


def pressure_at(position, pressure, point, h: float, rho_g: float) -> float:
    """Pressure [Pa] at a point from the fluid within the kernel's support, its hydrostatic gradient included
    (Adami et al. 2012, eq. 27, for a wall at rest); 0 where there is no fluid, and in the air over it, where the gradient goes
    on below zero."""
    return _mean_pressure(position, pressure, point, h, rho_g)
