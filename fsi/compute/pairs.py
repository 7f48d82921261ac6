"""The one loop over pairs: every sum over the neighbours of particles runs through it.

A kernel is made of small functions, each written for one group of particles in vector lanes (`fsi.compute.lanes`):

    hold(s, ...)                what the lanes hold: the numbers of the group's particles, from row s on
    empty(...)                  the sums before the first neighbour, a tuple of lanes
    pair(sums, mine, j, ...)    the sums with the neighbour in row j; `mine` is what `hold` gave
    finish(i, sums, ...)        what is done with the sums of particle i, which are plain numbers here, and tuples of
                                numbers for vectors

After those in front, each names the arguments of the kernel that it needs, in any order; `takes` lists all in the order of
the call, `team.run(kernel, bounds, groups, *takes)`. To add a kernel: write its pair term in `fsi.sph.terms`, write these
functions in a factory as `fsi.sph.pressure.make_source` does (a term that is switched off there is not compiled),
and return

    over_pairs("name", (lanes, dim, ...), takes="flow force k", sum=Sum(hold, empty, ((FLUID, pair),), finish))

where the second argument tells the variants of the factory apart. A list holds the fluid first and the boundary after: a
`Sum` has one pass (`FLUID`, `WALLS` or `ALL`, pair) or several, one after the other. `python -m cases.bench.kernels` times it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fsi.compute.jit import compiled, helper
from fsi.compute.lanes import at, claim, lane_of, numbers_in, pick, store_all

FLUID, WALLS, ALL = (0, 1), (1, 2), (0, 2)  # parts of a list, as columns of the span of its group
# Besides its arguments, a kernel's functions may ask for: the number of the chunk, the part of the list `neighbours` that
# holds walls, and what `scratch` made.
PLACE = ("chunk", "walls_from", "walls_to", "neighbours", "scratch")


class Sum(NamedTuple):
    """What is summed up for a group, see above. `after(sums, mine, ...)`, if any, turns the sums over, still in lanes."""

    hold: Callable
    empty: Callable
    passes: tuple[tuple[tuple[int, int], Callable], ...]
    finish: Callable
    after: Callable | None = None


def over_pairs(
    name: str, variant: tuple, *, takes: str, sum: Sum, where: Callable | None = None, otherwise: Sum | None = None,
    start: Callable | None = None, scratch: Callable | None = None,
):  # fmt: skip
    """The kernel `name` of this variant.

    where(s, e, ...): whether the group of rows s to e is summed up; the other groups take the sum `otherwise`, or none.
    start(chunk, ...): called before the groups of each chunk. scratch(): arrays that a thread keeps for `finish`."""
    make = _Maker(name, variant, takes.split())
    work, room = make.work(sum, "")
    other_work, other_room = make.work(otherwise, "other") if otherwise else (work, room)
    choose = make.function(where or (lambda s, e: True), "where", 2)
    begin = make.function(start or (lambda chunk: None), "start", 1)
    make_scratch = helper(*make.variant("scratch"), inline=True)(scratch or (lambda: ()))
    first = pick(make.names(sum.empty, 0)[1][:1])
    chosen, alternative = where is not None, otherwise is not None

    def loop(counter, bounds, groups, *args):
        offset, count, group, span, list_offset, lst = groups
        buffer = np.empty(max(room(args), other_room(args)), first((), args)[0].dtype)
        extra = make_scratch()
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            begin(c, (), args)
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                place = c, base + span[g, 1], base + span[g, 2], lst, extra
                if chosen:
                    if choose(s, e, place, args):
                        work(s, e, g, base, span, lst, buffer, place, args)
                    elif alternative:
                        other_work(s, e, g, base, span, lst, buffer, place, args)
                else:
                    work(s, e, g, base, span, lst, buffer, place, args)

    loop.__name__, loop.__module__ = name, sum.finish.__module__
    return compiled(*variant)(loop)


class _Maker:
    """Turns the functions of a kernel into helpers that take all its arguments and hand on those that each names."""

    def __init__(self, name: str, variant: tuple, takes: list[str]):
        self._name, self._variant, self._takes = name, variant, takes
        self._made = {}  # a function may serve two sums

    def variant(self, role: str) -> tuple:
        return self._name, role, *self._variant

    def names(self, function: Callable, given: int) -> tuple[list[str], tuple]:
        """The arguments that a function names after the `given` ones, and where they are."""
        names = list(inspect.signature(function).parameters)[given:]
        try:
            return names, tuple((0, PLACE.index(n)) if n in PLACE else (1, self._takes.index(n)) for n in names)
        except ValueError:
            raise TypeError(
                f"{self._name}: {function.__name__} names {names}, but the kernel takes {self._takes}"
            ) from None

    def function(self, function: Callable, role: str, given: int) -> Callable:
        """function(given ..., place, args)"""
        if function not in self._made:
            chosen = pick(self.names(function, given)[1])
            inner = helper(*self.variant(role), inline=True)(function)
            call = _handing_on(inner, chosen, given)
            call.__module__ = function.__module__
            self._made[function] = helper(*self.variant(role), inline=True)(call)
        return self._made[function]

    def work(self, sum: Sum, role: str) -> tuple[Callable, Callable]:
        """Sums up a group, and the room [numbers] that its sums take."""
        hold = self.function(sum.hold, role + "hold", 1)
        empty = self.function(sum.empty, role + "empty", 0)
        add = self.passes(sum.passes, role)
        after = self.function(sum.after or (lambda sums, mine: sums), role + "after", 2)
        finish = self.function(sum.finish, role + "finish", 2)

        def work(s, e, g, base, span, lst, buffer, place, args):
            mine = hold(s, place, args)
            sums = after(add(empty(place, args), mine, g, base, span, lst, args), mine, place, args)
            store_all(buffer, sums)
            for i in range(s, e):
                finish(i, lane_of(buffer, i - s, sums), place, args)

        def room(args):
            return numbers_in(empty((), args))

        work.__module__ = room.__module__ = sum.finish.__module__
        variant = self.variant(role)
        return helper(*variant, inline=True)(work), helper(*variant, inline=True)(room)

    def passes(self, passes: tuple, role: str) -> Callable:
        """The sums with the neighbours of each pass, one pass after the other."""
        if not passes:

            def add(sums, mine, g, base, span, lst, args):
                return sums

        else:
            ((FIRST, LAST), pair), *others = passes
            pair = self.function(pair, f"{role}pair{len(passes)}", 3)
            rest = self.passes(tuple(others), role)

            def add(sums, mine, g, base, span, lst, args):
                for n in range(base + span[g, FIRST], base + span[g, LAST]):
                    sums = pair(sums, mine, at(lst, n), (), args)
                return rest(sums, mine, g, base, span, lst, args)

        return helper(*self.variant(f"{role}pass{len(passes)}"), inline=True)(add)


def _handing_on(inner: Callable, chosen: Callable, given: int) -> Callable:
    """`inner` with its first arguments as they are, and those chosen of the others."""
    if given == 0:

        def call(place, args):
            return inner(*chosen(place, args))

    elif given == 1:

        def call(a, place, args):
            return inner(a, *chosen(place, args))

    elif given == 2:

        def call(a, b, place, args):
            return inner(a, b, *chosen(place, args))

    else:

        def call(a, b, c, place, args):
            return inner(a, b, c, *chosen(place, args))

    return call
