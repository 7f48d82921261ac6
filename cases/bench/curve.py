"""Would cells along a Peano-Hilbert curve be faster than pencils? `python -m cases.bench.curve [--spacing 0.01]`.

The lists of a tank of still water are renumbered as if its rows stood in another order, with the same groups of neighbours in
vector lanes, and one pressure sweep over them is timed in each order by turns: pencils along x, layer by layer, as all runs
have them; the same pencils along a Hilbert curve across x; groups along a Hilbert curve in space; groups in no order, to show
what can be lost. The cost of keeping such an order and of finding its cells is not counted.
"""

from __future__ import annotations

import argparse
import time as clock

import numpy as np

from fsi.compute.pairs import ROW
from fsi.particles.neighbours import put_steps, rows_of
from fsi.scene.file import load_scene
from fsi.simulation.loop import Simulation
from fsi.sph import columns, pressure


def hilbert(cells: np.ndarray) -> np.ndarray:
    """Place (n,) along a Hilbert curve of cells (n, dim), whole numbers from 0 on, by exchanging and inverting the bits of
    their coordinates from the highest down (Skilling 2004, AIP Conf. Proc. 707, 381-387)."""
    x = cells.T.astype(np.int64).copy()
    dim, bits = len(x), max(1, int(cells.max(initial=1)).bit_length())
    for bit in range(bits - 1, 0, -1):
        low = (1 << bit) - 1
        for d in range(dim):
            on = (x[d] >> bit) & 1 == 1
            swap = np.where(on, 0, (x[0] ^ x[d]) & low)
            x[0] = np.where(on, x[0] ^ low, x[0] ^ swap)
            x[d] ^= swap
    for d in range(1, dim):
        x[d] ^= x[d - 1]
    turn = np.zeros_like(x[0])
    for bit in range(bits - 1, 0, -1):
        turn ^= np.where((x[dim - 1] >> bit) & 1 == 1, (1 << bit) - 1, 0)
    x ^= turn
    place = np.zeros_like(x[0])
    for bit in range(bits - 1, -1, -1):
        for d in range(dim):
            place = (place << 1) | ((x[d] >> bit) & 1)
    return place


def renumbered(groups: tuple, order: np.ndarray, rows: int) -> tuple[tuple, np.ndarray]:
    """Groups and lists as if the groups of fluid rows (g,) stood in this order, and the new row of each of the old ones; the
    lists ascend in the new rows, as those of a search in that order would."""
    offset, count, group, span, base, _ = groups
    lists = rows_of(groups)
    first, last, start, end, walls = [], [], [], [], []
    for c in range(len(count)):
        g = np.arange(offset[c], offset[c] + count[c])
        first.append(group[g])
        last.append(group[g + 1])
        start.append(base[c] + span[g, 0])
        walls.append(base[c] + span[g, 1])
        end.append(base[c] + span[g, 2])
    first, last, start, walls, end = (
        np.concatenate(a).astype(np.int64)[order] for a in (first, last, start, walls, end)
    )
    sizes = last - first
    row = np.arange(rows)
    edges = np.concatenate([[0], np.cumsum(sizes)])
    for old, new, size in zip(first, edges[:-1], sizes, strict=True):
        row[old : old + size] = np.arange(new, new + size)
    span, k = np.zeros((len(order), ROW + 2), np.int64), 0
    steps = np.empty(2 * int((end - start).sum()) + 16, np.uint16)
    for n, (a, w, b) in enumerate(zip(start, walls, end, strict=True)):
        span[n, 0] = k
        for part, rows_there in enumerate((np.sort(row[lists[a:w]]), lists[w:b])):
            span[n, ROW + part] = rows_there[0] if len(rows_there) else 0
            k = span[n, part + 1] = put_steps(rows_there, len(rows_there), steps, k, steps.size)
    chunks = max(1, len(order) // 256)
    bounds = np.arange(chunks + 1) * len(order) // chunks
    group = np.concatenate([edges[:-1], edges[-1:]]).astype(np.int32)
    bases = span[bounds[:-1], 0]
    for c in range(chunks):
        span[bounds[c] : bounds[c + 1], :ROW] -= bases[c]
    groups = bounds[:-1].copy(), np.diff(bounds), group, span.astype(np.int32), bases, steps
    return groups, row


def orders(middle: np.ndarray, cell: float, support: float) -> dict[str, np.ndarray]:
    """Orders of groups with these middles (g, dim), by name."""
    places = ((middle - middle.min(0)) / cell).astype(np.int64)
    across = hilbert(((middle - middle.min(0)) / support).astype(np.int64)[:, 1:])
    random = np.random.default_rng(0).permutation(len(middle))
    return {
        "pencils": np.arange(len(middle)),
        "pencils along a Hilbert curve": np.lexsort((places[:, 0], *places[:, 1:].T, across)),
        "Hilbert curve": np.argsort(hilbert(places), kind="stable"),
        "no order": random,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spacing", type=float, default=0.0125, help="[m], of a tank of 1 x 0.5 x 0.5 m")
    parser.add_argument("--turns", type=int, default=8)
    options = parser.parse_args()
    settings = [f"spacing={options.spacing}", "fluid.start=hydrostatic"]
    sim = Simulation(load_scene("tank_still", settings), threads=1)
    sim.step()
    fluid, work = sim.fluid, sim.fluid.work
    offset, count, group, *_ = fluid.near.groups
    firsts = np.concatenate([group[offset[c] : offset[c] + count[c]] for c in range(len(count))])
    middle, support = work.field[firsts, : fluid.dim].astype(float), 2 * sim.scene.smoothing_length
    kernel, k = pressure.make_sweep(fluid.lanes, fluid.dim, False, 0), fluid.k
    P, n, made = columns.field(fluid.dim).p, fluid.count, {}
    nothing = np.empty((0, 0), fluid.dtype), np.zeros(fluid.dim)
    for name, order in orders(middle, sim.scene.spacing, support).items():
        groups, row = renumbered(fluid.near.groups, order, len(work.field))
        field, new = np.empty_like(work.field), np.empty_like(work.field)
        coefficients = np.empty_like(work.coefficients)
        field[row] = new[row] = work.field
        coefficients[row[:n]] = work.coefficients[:n]
        made[name] = groups, field, new, coefficients, row
    best = dict.fromkeys(made, np.inf)
    for _ in range(options.turns):
        for name, (groups, field, new, coefficients, _row) in made.items():
            start = clock.process_time()
            bounds = np.arange(len(groups[1]) + 1)
            kernel(
                np.zeros(1, np.int64), bounds, groups, field, new, coefficients, k, fluid.dtype(1), fluid.dtype(0),
                nothing[0], nothing[0], nothing[1], nothing[1],
            )  # fmt: skip
            best[name] = min(best[name], clock.process_time() - start)
    like = made["pencils"][2][made["pencils"][4][:n], P]
    for name, (_, _, new, _, row) in made.items():
        apart = np.abs(new[row[:n], P] - like).max() / np.abs(like).max()
        share = best[name] / best["pencils"]
        print(f"{name:30} {1e9 * best[name] / n:7.1f} ns a particle, {share:.3f} of pencils, pressure to {apart:.0e}")
    sim.close()


if __name__ == "__main__":
    main()
