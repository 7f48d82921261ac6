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

where the second argument tells the variants of the factory apart. A list has two parts, the fluid and the boundary: a
`Sum` has one pass (`FLUID`, `WALLS` or `ALL`, pair) or several, one after the other; a pass of several pairs, (`FLUID`, pair,
other_pair), takes each neighbour through all of them, and what they have in common is computed once.

A list holds steps from row to row (`fsi.particles.neighbours`), some of which lead to rows out of reach: no sum may depend on
those, not in its last bit either.
`python -m cases.bench.kernels` times it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

from fsi.compute.jit import compiled, helper
from fsi.compute.lane_sums import lane_of, room_for, store_all
from fsi.compute.lanes import at, claim

FLUID, WALLS, ALL = (0, 1), (1, 2), (0, 2)  # parts of a list, as columns of the span of its group
ROW = 3  # column of the span of a group from which on it holds the rows that its parts begin at
# Besides its arguments, a kernel's functions may ask for: the number of the chunk, the part of the list `steps` that holds
# walls, and the row that it begins at; a `pair` also for its place n there.
PLACE = ("chunk", "walls_from", "walls_to", "walls_row", "steps", "n")


class Sum(NamedTuple):
    """What is summed up for a group, see above. `after(sums, mine, ...)`, if any, turns the sums over, still in lanes."""

    hold: Callable
    empty: Callable
    passes: tuple[tuple, ...]
    finish: Callable
    after: Callable | None = None


def over_pairs(
    name: str, variant: tuple, *, takes: str, sum: Sum, where: Callable | None = None, otherwise: Sum | None = None,
    start: Callable | None = None,
):  # fmt: skip
    """The kernel `name` of this variant.

    where(s, e, ...): whether the group of rows s to e is summed up; the other groups take the sum `otherwise`, or none.
    start(chunk, ...): called before the groups of each chunk. No function may allocate memory; scratch that the compiler
    can keep on the stack is made by `small` and `small_matrix` of `fsi.compute.lanes`.

    Raises TypeError where a function names what the kernel does not take."""
    text = _Text(name, variant, takes.split())
    work = text.work(sum, "a")
    if where:
        work = f"if {text.call(where, 'where', 's', 'e')}:\n{_indented(work)}"
        work += f"else:\n{_indented(text.work(otherwise, 'b'))}" if otherwise else ""
    lines = LOOP.format(
        name=name,
        takes=", ".join(takes.split()),
        row=ROW,
        buffers="".join(text.buffers),
        start=f"{text.call(start, 'start', 'c')}\n" if start else "",
        work=_indented(work, 3).lstrip(),
    )
    scope = dict(text.functions)
    exec(compile("\n".join(line for line in lines.splitlines() if line.strip()), __file__, "exec"), scope)
    loop = scope[name]
    loop.__module__ = sum.finish.__module__
    return compiled(*variant, bare=True)(loop)


LOOP = """
def {name}(counter, bounds, groups, {takes}):
    offset, count, group, span, list_offset, steps = groups
    {buffers}
    while True:
        chunk = c = claim(counter)
        if c >= bounds.size - 1:
            break
        base = list_offset[c]
        {start}
        for g in range(offset[c], offset[c] + count[c]):
            s, e = group[g], group[g + 1]
            walls_from, walls_to, walls_row = base + span[g, 1], base + span[g, 2], span[g, {row} + 1]
            {work}
"""


def _indented(text: str, by: int = 1) -> str:
    return "".join(f"{'    ' * by * bool(line)}{line}\n" for line in text.splitlines())


class _Text:
    """Writes the loop out, so that each function of a kernel is called with just the arguments that it names; they are inlined
    as they stand, and the compiler sees one plain loop."""

    def __init__(self, name: str, variant: tuple, takes: list[str]):
        self._name, self._variant, self._takes = name, variant, takes
        self.functions = {"claim": claim, "at": at, "store_all": store_all, "lane_of": lane_of, "room_for": room_for}
        self.buffers: list[str] = []

    def call(self, function: Callable, role: str, *given: str) -> str:
        """The text of a call with the `given` arguments in front."""
        named = list(inspect.signature(function).parameters)[len(given) :]
        unknown = [name for name in named if name not in (*self._takes, *PLACE)]
        if unknown:
            raise TypeError(f"{self._name}: {function.__name__} names {unknown}, but the kernel takes {self._takes}")
        self.functions[role] = helper(self._name, role, *self._variant, inline=True)(function)
        return f"{role}({', '.join([*given, *named])})"

    def work(self, sum: Sum, role: str) -> str:
        """The text that sums up the group g."""
        empty = self.call(sum.empty, f"{role}_empty")
        self.buffers.append(f"{role}_buffer = room_for({empty})\n    ")
        text = f"mine = {self.call(sum.hold, f'{role}_hold', 's')}\nsums = {empty}\n"
        for n, ((first, last), *pairs) in enumerate(sum.passes):
            text += f"j = span[g, {ROW + first}]\nfor n in range(base + span[g, {first}], base + span[g, {last}]):\n"
            text += f"    j = {'walls_row if n == walls_from else ' * (last - first > 1)}j + at(steps, n)\n"
            for m, pair in enumerate(pairs):
                call = self.call(pair, f"{role}_pair{n}_{m}", "sums", "mine", "j")
                text += f"    sums = {call}\n"
        if sum.after:
            text += f"sums = {self.call(sum.after, f'{role}_after', 'sums', 'mine')}\n"
        finish = self.call(sum.finish, f"{role}_finish", "i", f"lane_of({role}_buffer, i - s, sums)")
        return text + f"store_all({role}_buffer, sums)\nfor i in range(s, e):\n    {finish}\n"
