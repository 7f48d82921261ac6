"""The wall guard: keeps fluid particles off the wall particles, whatever their arrangement.

Wall particles within `REACH` spacings crowd a fluid particle by phi = sum (1 - r^2 / R^2)^2, R = REACH spacings. The level of
phi that a lone wall particle causes at a distance of `guard` = 0.7 is reached 0.70 to 0.74 spacings above a row or a
square lattice of them: the surface that a particle may not pass is almost flat, has no pockets in which particles would
catch, and closes holes of a whole spacing. A particle that starts beyond it may move along its own level.
"""

from __future__ import annotations

import math
from functools import cache

from fsi.compiled import helper

REACH = 1.25  # spacings over which wall particles crowd
PIECE = 0.2  # spacings; the way of a step is followed in pieces no longer than that
ROUNDS = 4  # of correction at most after each piece


def level(guard: float) -> float:
    """phi at the distance `guard` [spacing] from a lone wall particle; infinite where the guard is off."""
    return (1.0 - (guard / REACH) ** 2) ** 2 if guard > 0 else math.inf


@cache
def make_guard(dim: int):
    """`bend(...)`: the way of particle i in this step, bent so that it does not end where phi is above the level."""
    DIM = dim

    @helper(dim)
    def crowding(i, near, far, lst, position, way, first, boundary, boundary_velocity, k, time, gradient):
        """phi of particle i after a part `way` of its way, when the walls have moved for `time`; its gradient into
        `gradient`."""
        phi = 0.0
        gradient[:] = 0.0
        for n in range(near, far):
            b = lst[n] - first
            close = 1.0
            for d in range(DIM):
                x = position[i, d] + way[d] - boundary[b, d] - time * boundary_velocity[b, d]
                close -= x * x * k.guard_reach2
            if close > 0.0:
                phi += close * close
                for d in range(DIM):
                    x = position[i, d] + way[d] - boundary[b, d] - time * boundary_velocity[b, d]
                    gradient[d] -= 4.0 * k.guard_reach2 * close * x
        return phi

    @helper(dim)
    def push(
        i,
        near,
        far,
        lst,
        position,
        way,
        first,
        boundary,
        boundary_velocity,
        k,
        time,
        size,
        owner,
        centre,
        weight,
        taken,
        at,
    ):
        """Move the end of the way by -size times the gradient of phi; each wall particle's part of it, times -weight, is
        an impulse on its owner."""
        at[:] = way
        for n in range(near, far):
            b = lst[n] - first
            close = 1.0
            for d in range(DIM):
                x = position[i, d] + at[d] - boundary[b, d] - time * boundary_velocity[b, d]
                close -= x * x * k.guard_reach2
            if close > 0.0:
                for d in range(DIM):
                    x = position[i, d] + at[d] - boundary[b, d] - time * boundary_velocity[b, d]
                    change = 4.0 * size * k.guard_reach2 * close * x
                    way[d] += change
                    take_moment(i, d, -weight * change, position, owner[b], centre, taken)

    @helper(dim)
    def take_moment(i, d, impulse, position, o, centre, taken):
        """Add an impulse along d at particle i to what owner o has taken, and its moment about the owner's centre."""
        axis = 2 if d == DIM - 1 else d
        taken[o, axis] += impulse
        for a in range(DIM):  # moment = arm x impulse, in right-handed (x, y, z)
            arm = position[i, a] - centre[o, a]
            axis_a = 2 if a == DIM - 1 else a
            if axis_a != axis:
                sign = 1.0 if (axis - axis_a) % 3 == 1 else -1.0
                taken[o, 3 + 3 - axis - axis_a] += sign * arm * impulse

    @helper(dim)
    def bend(
        i, near, far, lst, position, way, first, boundary, boundary_velocity, owner, centre, k, dt, weight, taken, room
    ):
        """Bend the `way` (DIM,) of particle i among the wall particles of its list; returns whether it had to. What that
        takes, times `weight`, goes to the walls' owners. `room` (3, DIM) is scratch."""
        done, gradient, at = room[0], room[1], room[2]
        done[:] = 0.0
        allowed = max(
            k.guard_level,
            crowding(i, near, far, lst, position, done, first, boundary, boundary_velocity, k, 0.0, gradient),
        )
        length2 = 0.0
        for n in range(near, far):
            b, r2, apart2 = lst[n] - first, 0.0, 0.0
            for d in range(DIM):
                apart2 += (position[i, d] - boundary[b, d]) ** 2
                r2 += (way[d] - dt * boundary_velocity[b, d]) ** 2
            if apart2 < k.guard2:
                length2 = max(length2, r2)
        pieces = 1 + int(math.sqrt(length2) / k.guard_piece)
        bent = False
        for p in range(1, pieces + 1):
            for d in range(DIM):
                done[d] += way[d] / pieces
            time = dt * p / pieces
            for _ in range(ROUNDS):
                phi = crowding(i, near, far, lst, position, done, first, boundary, boundary_velocity, k, time, gradient)
                if phi <= 1.001 * allowed:
                    break
                slope2 = 1e-12 * k.guard_reach2
                for d in range(DIM):
                    slope2 += gradient[d] * gradient[d]
                size = min((phi - allowed) / slope2, k.guard_piece / math.sqrt(slope2))
                push(
                    i,
                    near,
                    far,
                    lst,
                    position,
                    done,
                    first,
                    boundary,
                    boundary_velocity,
                    k,
                    time,
                    size,
                    owner,
                    centre,
                    weight,
                    taken,
                    at,
                )
                bent = True
        if bent:
            for d in range(DIM):
                way[d] = done[d]
        return bent

    return bend
