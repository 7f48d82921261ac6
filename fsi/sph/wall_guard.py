"""The wall guard: keeps fluid particles off the wall particles, whatever their arrangement.

Wall particles within `REACH` spacings crowd a fluid particle by phi = sum (1 - r^2 / R^2)^2, R = REACH spacings. The level of
phi that a lone wall particle causes at a distance of `guard` = 0.7 is reached 0.70 to 0.74 spacings above a row or a
square lattice of them: the surface that a particle may not pass is almost flat, has no pockets in which particles would
catch, and closes holes of a whole spacing. A particle that starts beyond it may move along its own level.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fsi.compute.jit import helper
from fsi.compute.lane_sums import plus, small

REACH = 1.25  # spacings over which wall particles crowd
PIECE = 0.2  # spacings; the way of a step is followed in pieces no longer than that
ROUNDS = 4  # of correction at most after each piece
AIM = 0.999  # share of the level allowed that a correction aims at; more than all of it, and short steps would add up
SQUEEZED = (
    0.25  # gradient over the sum of its parts' sizes, below which walls on both sides leave a particle no way out
)


def level(guard: float) -> float:
    """phi at the distance `guard` [spacing] from a lone wall particle; infinite where the guard is off."""
    return (1.0 - (guard / REACH) ** 2) ** 2 if guard > 0 else math.inf


@cache
def make_guard(dim: int):
    """`bend(x, way, walls, account, k, dt)`: the way of a particle in this step, bent so that it does not end where
    phi is above the level.

    x (DIM,): where it is. walls: (near, far, steps, first, boundary, boundary_velocity), its wall particles are those that
    steps[near:far] lead to from `first` on. account: (owner, centre, weight, taken), what bends the way, times weight, is an
    impulse on the owners, added with its moment to taken (owners, 6), as integers, whose sum does not depend on the order; the
    last two columns of centre say how many there are to 1 N s, and to 1 N m s."""
    DIM = dim

    @helper(dim)
    def closeness_to(b, x, way, walls, k, time, apart):
        """1 - r^2 / R^2 to wall particle b, when it has moved for `time` and the particle for `way`; the vector from it
        into `apart`."""
        close = 1.0
        for d in range(DIM):
            apart[d] = x[d] + way[d] - walls[4][b, d] - time * walls[5][b, d]
            close -= apart[d] * apart[d] * k.guard_reach2
        return close

    @helper(dim)
    def crowding(x, way, walls, owner, last, k, time, gradient, apart):
        """phi of the walls of owners up to the `last` after a part of the way, and the sum of the sizes of its gradient's
        parts; the gradient into `gradient`. The last bits of these sums do not depend on wall particles out of reach."""
        phi, parts, (near, far, steps, b, _, _) = 0.0, 0.0, walls
        gradient[:] = 0.0
        for n in range(near, far):
            b += steps[n]
            close = closeness_to(b, x, way, walls, k, time, apart)
            if close > 0.0 and owner[b] <= last:
                phi = plus(phi, close * close)
                parts = plus(parts, 4.0 * close * math.sqrt(k.guard_reach2 * (1.0 - close)))
                for d in range(DIM):
                    gradient[d] = plus(gradient[d], -4.0 * k.guard_reach2 * close * apart[d])
        return phi, parts

    @helper(dim)
    def add(d, impulse, x, o, centre, taken):
        """Add an impulse along d at x to what owner o has taken, and its moment about the owner's centre, in whole units."""
        axis, per_impulse, per_moment = 2 if d == DIM - 1 else d, centre[0, DIM], centre[0, DIM + 1]
        taken[o, axis] += np.int64(np.rint(impulse * per_impulse))
        for a in range(DIM):
            axis_a = 2 if a == DIM - 1 else a  # moment = arm x impulse, in right-handed (x, y, z)
            if axis_a != axis:
                sign = 1.0 if (axis - axis_a) % 3 == 1 else -1.0
                moment = sign * (x[a] - centre[o, a]) * impulse
                taken[o, 3 + 3 - axis - axis_a] += np.int64(np.rint(moment * per_moment))

    @helper(dim)
    def push(x, way, walls, account, last, k, time, size, gradient, apart):
        """Move the end of the way by -size times the gradient of phi; each wall particle's part of that is an impulse on
        its owner."""
        near, far, steps, b, _, _ = walls
        owner, centre, weight, taken = account
        for n in range(near, far):
            b += steps[n]
            close = closeness_to(b, x, way, walls, k, time, apart)
            if close > 0.0 and owner[b] <= last:
                for d in range(DIM):
                    part = 4.0 * size * k.guard_reach2 * close * apart[d]
                    add(d, -weight * part, x, owner[b], centre, taken)
        for d in range(DIM):
            way[d] -= size * gradient[d]

    @helper(dim)
    def survey(x, way, walls, k, dt):
        """In one pass, for most particles are far from trouble: phi at the start and at the end of the way, and the longest
        way [m] relative to the wall particles that it might reach."""
        before, behind, length2, (near, far, steps, b, boundary, boundary_velocity) = 0.0, 0.0, 0.0, walls
        for n in range(near, far):
            b += steps[n]
            start2, end2, way2 = 0.0, 0.0, 0.0
            for d in range(DIM):
                apart, step = x[d] - boundary[b, d], way[d] - dt * boundary_velocity[b, d]
                start2 += apart * apart
                end2 += (apart + step) ** 2
                way2 += step * step
            close, closer = 1.0 - start2 * k.guard_reach2, 1.0 - end2 * k.guard_reach2
            if close > 0.0:
                before = plus(before, close * close)
            if closer > 0.0:
                behind = plus(behind, closer * closer)
            if start2 < k.guard2:
                length2 = max(length2, way2)
        return before, behind, math.sqrt(length2)

    @helper(dim)
    def hold(x, way, walls, account, last, allowed, k, time, gradient, apart):
        """Move the end of the way until the walls of owners up to the `last` crowd it no more than `allowed`; returns
        whether it moved, and whether walls on both sides left no way out."""
        moved = False
        for _ in range(ROUNDS):
            phi, parts = crowding(x, way, walls, account[0], last, k, time, gradient, apart)
            if phi <= allowed:
                break
            slope2 = 0.0
            for d in range(DIM):
                slope2 += gradient[d] * gradient[d]
            steep2 = max(slope2, (SQUEEZED * parts) ** 2)
            size = min((phi - AIM * allowed) / steep2, k.guard_piece / math.sqrt(steep2))
            push(x, way, walls, account, last, k, time, size, gradient, apart)
            moved = True
            if steep2 > slope2:
                return True, True
        return moved, False

    @helper(dim)
    def bend(x, way, walls, account, k, dt):
        """Returns whether the way had to be bent. A particle that a body squeezes against the
        tank stays in the tank."""
        before, behind, length = survey(x, way, walls, k, dt)
        allowed, pieces = max(k.guard_level, before), 1 + int(length / k.guard_piece)
        if pieces == 1 and behind <= allowed:
            return False
        done, gradient, apart, start = small(DIM), small(DIM), small(DIM), small(DIM)
        done[:], start[:] = 0.0, 0.0
        every, ground = account[1].shape[0], 0  # the last owner whose walls count
        bent = False
        for p in range(1, pieces + 1):
            for d in range(DIM):
                done[d] += way[d] / pieces
            time = dt * p / pieces
            moved, squeezed = hold(x, done, walls, account, every, allowed, k, time, gradient, apart)
            if squeezed:
                inside = max(k.guard_level, crowding(x, start, walls, account[0], ground, k, 0.0, gradient, apart)[0])
                hold(x, done, walls, account, ground, inside, k, time, gradient, apart)
            bent = bent or moved
        if bent:
            for d in range(DIM):
                way[d] = done[d]
        return bent

    return bend
