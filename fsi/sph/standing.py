"""The pressure that stands in the water anyway, as a function of the depth.

At a depth d below a level the standing pressure P over the weight rho g of the water is the integral of s(t), t = (d - start) /
width, s = t^3 (10 - 15 t + 6 t^2) from 0 to 1: none in the rows under the surface, all but start + width / 2 of the hydrostatic
pressure from start + width on. Lengths in m.
"""

from __future__ import annotations

from fsi.compute.jit import exact, helper
from fsi.compute.lanes import claim


@helper()
def standing(depth, start, width, moment):
    """P over rho g [m], and its gradient as a sum over pairs has it: s + moment s''."""
    t = (depth - start) / width
    if t <= 0.0:
        return 0.0, 0.0
    if t >= 1.0:
        return depth - start - 0.5 * width, 1.0
    head = width * t**4 * (2.5 - 3.0 * t + t * t)
    bend = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / width**2
    return head, t**3 * (10.0 - 15.0 * t + 6.0 * t * t) + moment * bend


@exact
def heads(counter, bounds, position, pressure, up, weight, head):
    """Height that water stands to above each particle: its own and its pressure over the weight rho g [N/m3]."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            head[i] = pressure[i] / weight
            for d in range(position.shape[1]):
                head[i] += up[d] * position[i, d]


@exact
def stand(counter, bounds, position, up, level, shape, weight, first, pressure, growth):
    """Standing `pressure` [Pa], from its row `first` on, and its `growth` with the depth over the weight rho g [N/m3], of
    points under a level; `shape`: start, width and moment."""
    start, width, moment = shape
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            depth = level
            for d in range(position.shape[1]):
                depth -= up[d] * position[i, d]
            head, growth[i] = standing(depth, start, width, moment)
            pressure[first + i, 0] = weight * head
