"""Boundary particles in layers under any closed surface with a distance function.

Every particle stands for spacing**dim of volume, and the outermost layer lies half a spacing below the surface.
"""

from __future__ import annotations

import math

import numpy as np

from bodies.shapes import edges, thinning
from bodies.shapes.around import Around
from bodies.shapes.band import Band, Nearest
from bodies.shapes.edges import inward

SETTLING = {2: 60, 3: 4}  # passes that even the distances out; along a line a gap spreads slowly
STILL = {2: 0.0, 3: 0.05}  # spacings to the middle of its neighbours from which on a particle stays
FINE = {2: 8, 3: 2}  # steps of the lattice in a spacing
NARROW, PARTINGS = 0.8, 6  # spacings that particles of a layer in space keep from each other, and passes for that
TRIES = {2: 12, 3: 5}  # of a radius that leaves as many lattice points as wanted
PARTS = {2: 4, 3: 1}  # of a candidate, strewn over its cell, by which those nearest to a particle are told
HOLE = (
    0.78  # spacings from the next particle to the middle of a hole that gets one of its own (on a square lattice 0.71)
)
ROUNDS = 3  # of filling holes at most


def under(
    nearest: Nearest, lower: np.ndarray, upper: np.ndarray, spacing: float, layers: int, finest: float
) -> np.ndarray:
    """Particles (n, dim) in layers under any closed surface within the box `lower` to `upper` (dim,).

    Lattice points, several per particle, slide along the normal onto their layer and are thinned to even distances,
    so many that each layer has the volume it stands for. Convex edges and corners of a layer are filled first, its
    faces around them. Where the solid is too thin for a layer they end half way through it: the first layer then counts
    by area, deeper ones are left out. `finest` [m] is a lattice that resolves the thinnest part.
    """
    step = min(spacing / FINE[len(lower)], finest)
    nearest, points, distance, foot = near(nearest, lower, upper, layers * spacing, step)
    depth = -distance
    parts = []
    for layer in range(layers):
        target = (layer + 0.5) * spacing
        shares = _cover(depth, layer * spacing, step) - _cover(depth, (layer + 1) * spacing, step)
        some = shares > 0
        within, shares = points[some], shares[some]
        moved, reached, first_reached = _slide(nearest, within, target, distance[some], foot[some])
        keep = reached > (0.0 if layer == 0 else target - 0.25 * spacing)
        thick = np.minimum(2 * reached[keep], spacing)
        wanted = (shares[keep] * step / thick).sum() * (step / spacing) ** (len(lower) - 1)
        shallow = within[(depth[some] > 0) & (depth[some] < target) & (first_reached < 0.99 * target)]
        first = edges.particles(nearest, shallow, target, spacing, step)
        parts.append(_fill(nearest, moved[keep], reached[keep], first, wanted, target, spacing, step))
    return np.vstack(parts)


def _fill(
    nearest: Nearest,
    points: np.ndarray,
    depth: np.ndarray,
    first: np.ndarray,
    wanted: float,
    target: float,
    spacing: float,
    step: float,
) -> np.ndarray:
    """About `wanted` particles (n, dim), evenly spread: the fixed ones `first` (k, dim), the others chosen from the
    candidates `points` (m, dim), each for a cell of size `step` and as close to the depth `target` [m] as `depth` (m,),
    and settled between their neighbours."""
    random = np.random.default_rng(0)
    parts = np.repeat(points, PARTS[points.shape[1]], axis=0)
    parts += random.uniform(-0.5, 0.5, parts.shape) * step  # on a lattice small steps would not move the centres
    others = thinning.thin_to(points, first, wanted, spacing, TRIES[points.shape[1]])
    if abs(len(first) + len(others) - wanted) > 0.01 * wanted:  # the lattice allows few distances
        strewn = points + random.uniform(-0.5, 0.5, points.shape) * step
        moved, reached, _ = _slide(nearest, strewn, target)
        others = thinning.thin_to(moved[reached > 0.95 * depth], first, wanted, spacing)
    passes = SETTLING[points.shape[1]]
    chosen = np.vstack([first, others])
    chosen = _settle(nearest, chosen, np.arange(len(first), len(chosen)), parts, target, spacing, passes)
    chosen = _close_holes(nearest, chosen, len(first), parts, target, spacing, passes)
    if chosen.shape[1] == 2:
        return chosen
    chosen = _part(nearest, chosen, len(first), target, spacing)
    return _on_layer(nearest, chosen, len(first), target)


def _on_layer(nearest: Nearest, chosen: np.ndarray, fixed: int, target: float) -> np.ndarray:
    """The `chosen` particles (k, 3), but for the first `fixed`, at exactly the depth `target` where a plane put them there."""
    if not isinstance(nearest, Band):
        return chosen
    distance, foot = nearest.exact(chosen)
    off = np.abs(distance + target)
    near = (off > 1e-6 * target) & (off < 0.1 * target)
    near[:fixed] = False
    chosen[near] = foot[near] + target * inward(chosen[near], foot[near], distance[near])
    return chosen


def _part(nearest: Nearest, chosen: np.ndarray, fixed: int, target: float, spacing: float) -> np.ndarray:
    """The `chosen` particles (k, 3), but for the first `fixed`, those nearer than NARROW to the next one moved away from it,
    unless that brings them nearer to another."""
    around = Around(chosen, spacing)
    for _ in range(PARTINGS):
        other, gap = around.nearest(chosen, NARROW * spacing)
        close = np.flatnonzero(other >= 0)
        close = close[close >= fixed]
        if len(close) == 0:
            break
        away = (chosen[close] - chosen[other[close]]) / np.maximum(gap[close], 1e-12)[:, None]
        push = np.where(other[close] < fixed, 1.0, 0.5) * (NARROW * spacing - gap[close])
        moved, reached, _ = _slide(nearest, chosen[close] + push[:, None] * away, target)
        good = np.abs(reached - target) < 0.01 * target
        parted = chosen.copy()
        parted[close[good]] = moved[good]
        narrower = around.nearest(parted, NARROW * spacing)[1] < gap
        chosen = np.where(narrower[:, None], chosen, parted)
    return chosen


def _close_holes(
    nearest: Nearest, chosen: np.ndarray, fixed: int, parts: np.ndarray, target: float, spacing: float, passes: int
) -> np.ndarray:
    """The `chosen` particles (k, dim) of a layer, and more where one of the `parts` (n, dim) is farther than HOLE
    from all of them, settled between their neighbours; the first `fixed` stay."""
    asked = parts  # those near which something has changed
    for _ in range(ROUNDS):
        far = np.flatnonzero(thinning.distances(asked, chosen, spacing) > 0.95 * HOLE * spacing)
        spots, reached, _ = _slide(nearest, asked[far], target)
        spots = spots[np.abs(reached - target) < 0.01 * target]
        away = thinning.distances(spots, chosen, spacing)
        worst = np.argsort(-away, kind="stable")
        worst = worst[away[worst] > HOLE * spacing]
        holes = thinning.apart(spots[worst], HOLE * spacing, chosen)
        if len(holes) == 0:
            break
        chosen = np.vstack([chosen, holes])
        if chosen.shape[1] == 2:
            chosen = _settle(nearest, chosen, np.arange(fixed, len(chosen)), parts, target, spacing, passes // 3)
            continue
        away = thinning.distances(chosen, holes, 6 * spacing)
        around = np.flatnonzero(away < 6 * spacing)
        loose = np.flatnonzero((away[around] < 3 * spacing) & (around >= fixed))
        asked = parts[thinning.distances(parts, holes, 4 * spacing) < 4 * spacing]
        chosen[around] = _settle(nearest, chosen[around], loose, asked, target, spacing, passes // 2)
    return chosen


def _settle(
    nearest: Nearest,
    chosen: np.ndarray,
    loose: np.ndarray,
    parts: np.ndarray,
    target: float,
    spacing: float,
    passes: int,
) -> np.ndarray:
    """The `chosen` particles (k, dim), those with the numbers `loose` (m,) moved to the middle of those of the `parts` (n, dim)
    of the layer that are nearest to them, step by step (Lloyd 1982)."""
    still = STILL[chosen.shape[1]] * spacing
    around, owner = Around(chosen, spacing), None
    before = around.nearest(chosen, spacing)[1]
    for _ in range(passes):
        owner, _ = around.owners(parts, chosen, owner)
        centre = thinning.means(parts, owner, chosen)[loose]
        moves = np.flatnonzero(np.linalg.norm(centre - chosen[loose], axis=1) >= still)
        moved, reached, _ = _slide(nearest, centre[moves], target)
        good = np.abs(reached - target) < 0.01 * target
        settled = chosen.copy()
        settled[loose[moves[good]]] = moved[good]
        gap = around.nearest(settled, spacing)[1]
        crowded = gap < np.minimum(0.75 * spacing, before)
        chosen = np.where(crowded[:, None], chosen, settled)
        before = around.nearest(chosen, spacing)[1] if crowded.any() else gap
    return chosen


def _cover(depth: np.ndarray, level: float, step: float) -> np.ndarray:
    """Share of the lattice cells, centred at `depth` (n,), that lies below the depth `level`."""
    return np.clip((depth - level) / step + 0.5, 0.0, 1.0)


def near(
    nearest: Nearest, lower: np.ndarray, upper: np.ndarray, reach: float, step: float
) -> tuple[Nearest, np.ndarray, np.ndarray, np.ndarray]:
    """Lattice points (n, dim) with spacing `step`, row by row, whose cells touch what lies inside within `reach` of the
    surface, their signed distance (n,) and closest surface point (n, dim), after what answers for points among them. Larger
    cells that the distance rules out are never refined; in space the last ones make a `Band`."""
    dim = len(lower)
    extent = float(np.max(upper - lower))
    level = max(0, math.ceil(math.log2(extent / (16 * step))))
    size = step * 2**level
    count = np.ceil((upper - lower) / size).astype(int)
    cells = (np.indices(count).reshape(dim, -1).T + 0.5 - count / 2) * size + (lower + upper) / 2
    cells += 0.01 * step  # so that no lattice plane lies in a face of the surface, where the normal is undefined
    corner = np.indices([2] * dim).reshape(dim, -1).T - 0.5
    for finer in range(level)[::-1]:
        distance, foot = nearest(cells)
        margin = size * math.sqrt(dim) / 2
        kept = (distance < margin) & (distance > -reach - margin)
        cells = cells[kept]
        if dim == 3 and finer == 0 and len(cells):
            nearest = Band(nearest, cells, distance[kept], foot[kept], size, (-reach - margin, margin))
        size /= 2
        cells = (cells[:, None] + corner * size).reshape(-1, dim)
    distance, foot = nearest(cells)
    chosen = np.flatnonzero((distance < step / 2) & (distance > -reach - step / 2))
    chosen = chosen[np.lexsort(np.round(cells[chosen] / step).T)]
    return nearest, cells[chosen], distance[chosen], foot[chosen]


def deepest(nearest: Nearest, lower: np.ndarray, upper: np.ndarray, spacing: float, finest: float) -> float:
    """Radius of the largest ball inside a closed surface [m], but not more than 1.25 spacings."""
    radius, enough = 0.0, 1.25 * spacing
    for step in (spacing, min(spacing / 2, finest)) if len(lower) == 3 else (min(spacing / 2, finest),):
        band, points, distance, foot = near(nearest, lower, upper, 1.5 * spacing, step)
        radius = float(_slide(band, points, enough, distance, foot)[1].max()) if len(points) else 0.0
        if radius > 0.99 * enough:
            break
    return radius


def _slide(
    nearest: Nearest,
    points: np.ndarray,
    target: float,
    distance: np.ndarray | None = None,
    foot: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, dim) moved to the depth `target` along the normal, or to the middle of what is thinner, the depths (n,) they
    reach, and those they had reached in the first pass. The passes carry points in a corner to the corner of the layer.
    `distance` (n,) and `foot` (n, dim) are what `nearest` says of the points, if known. Points that planes of a `Band` send
    to and fro are left to exact distances."""
    exact = nearest.exact if isinstance(nearest, Band) else nearest
    if distance is None:
        distance, foot = nearest(points)
    moved, reached, rest = points.copy(), -distance, np.arange(len(points))
    first = reached.copy()
    for turn in range(5):
        if turn:
            distance, foot = (nearest if turn < 3 else exact)(moved[rest])
            reached[rest] = -distance
        if turn == 1:
            first[rest] = reached[rest]
        off = np.abs(distance + target) > 1e-3 * target
        rest = rest[off]
        moved[rest] = foot[off] + target * inward(moved[rest], foot[off], distance[off])
    if rest.size:
        moved[rest] = _climb(exact, points[rest], target)
        reached[rest] = -exact(moved[rest])[0]
    return moved, reached, first


def onto(nearest: Nearest, points: np.ndarray, target: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, dim) moved to the depth `target` [m] along the normal, and which of them (n,) get there."""
    moved, reached, _ = _slide(nearest, points, target)
    return moved, np.abs(reached - target) < 0.01 * target


def _climb(nearest: Nearest, points: np.ndarray, target: float) -> np.ndarray:
    """Points (n, dim) moved away from the surface in ever shorter strides, until they are `target` deep or as deep as
    the solid is there. The strides are odd so that none ends on the far side of a plate, where there is no way back."""
    for stride in 0.437 * target * 0.77 ** np.arange(20):
        distance, foot = nearest(points)
        points = points + np.clip(target + distance, 0.0, stride)[:, None] * inward(points, foot, distance)
    return points
