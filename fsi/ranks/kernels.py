"""What a rank does to many particles at once: finding those that leave, keeping the order of cells, moving columns."""

from __future__ import annotations

import numpy as np

from fsi.compute.jit import exact

PLACE_BITS = 16  # of a key: place within a cell
CODE_BITS = 56  # from here on: the image, 0 for a particle itself


@exact
def outside(position, low, high, found):
    """Numbers of the particles that are not at low <= x < high, into `found` (n,); how many there are."""
    count = 0
    for i in range(position.shape[0]):
        inside = True
        for d in range(position.shape[1]):
            inside &= low[d] <= position[i, d] < high[d]
        if not inside:
            found[count] = i
            count += 1
    return count


@exact
def _arrange_cell(first, end, cell, order, key, new_key):
    for r in range(first + 1, end):
        i = order[r]
        own, at = key[i], r
        while at > first and key[order[at - 1]] > own:
            order[at] = order[at - 1]
            at -= 1
        order[at] = i
    for r in range(first, end):
        new_key[r] = (np.int64(cell) << PLACE_BITS) | (r - first)


@exact
def arrange(start, order, key, new_key):
    """Put the particles of each cell in the order of their keys, and give each row its new one, cell and place. start
    (cells + 1,), order (n,): particle at each row; key (n,) of the particles, new_key (rows,) of the rows."""
    for cell in range(start.size - 1):
        _arrange_cell(start[cell], start[cell + 1], cell, order, key, new_key)


@exact
def arrange_compact(index, shape, order, key, new_key):
    """The same for the used cells of a compact sort (`fsi.particles.compact_cells.Index`), in a grid of this shape (3,)."""
    low, layer, pencil, cells, x, start = index
    for k in range(layer.size - 1):
        for p in range(layer[k], layer[k + 1]):
            for c in range(cells[p], cells[p + 1]):
                cell = (np.int64(low[0] + k) * shape[1] + pencil[p]) * shape[0] + x[c]
                _arrange_cell(start[c], start[c + 1], cell, order, key, new_key)


OUTER, INNER = 1, 2  # groups that others wait for, and those that only this rank does


@exact
def split(offset, count, group, base, kind, which, first, length, start):
    """Runs of consecutive groups of the rows of one `kind` (rows,) within each chunk (`fsi.particles.neighbours`): their first
    groups, lengths and starts of lists, into arrays with room for all groups; how many runs there are. A group of several
    rows is outer where one of them is; groups of ghosts, 0, are left out."""
    runs = 0
    for c in range(count.size):
        last = 0
        for g in range(offset[c], offset[c] + count[c]):
            found = 0
            for row in range(group[g], group[g + 1]):
                if kind[row] == 1:
                    found = 1
                elif kind[row] == 2 and found == 0:
                    found = 2
            if found == which:
                if last != which:
                    first[runs], length[runs], start[runs] = g, 0, base[c]
                    runs += 1
                length[runs - 1] += 1
            last = found
    return runs


@exact
def pick(rows, source, first, last, out):
    """Columns first to last of the rows `source` (g,), one after the other in `out` (g, last - first)."""
    for g in range(source.size):
        for c in range(first, last):
            out[g, c - first] = rows[source[g], c]


@exact
def put(rows, target, first, last, given):
    """The same columns of the rows `target` (g,) from `given` (g, last - first); negative targets take nothing."""
    for g in range(target.size):
        if target[g] >= 0:
            for c in range(first, last):
                rows[target[g], c] = given[g, c - first]
