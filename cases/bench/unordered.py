"""What a fixed order of sums costs: a pressure sweep against one that takes each pair once and adds to both particles.

The sweeps of `fsi` compute a pair from both sides, so that one thread sums up each particle in the order of its list and no
result depends on the threads. The alternative halves the pairs, but two threads may add to a particle at once: atomic
additions, in an order that changes from run to run.
"""

from __future__ import annotations

import time
from functools import cache
from statistics import median

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from cases.bench.block import Block
from cases.bench.pairs import neighbours
from fsi.compute.jit import compiled
from fsi.compute.lanes import at, claim, load, other, own, own_vector, zero
from fsi.compute.pairs import ROW
from fsi.compute.team import Team
from fsi.fluid.response import LinearResponse
from fsi.particles.neighbours import W
from fsi.sph.columns import DIAGONAL, SOURCE
from fsi.sph.pressure import make_sweep, make_weight

FLAGS = ("reassoc", "nnan", "ninf", "nsz", "contract")


@intrinsic
def add_sum(typing, array, i, lanes):
    """array[i] += the sum of all lanes, atomically."""

    def gen(context, builder, sig, args):
        vector = args[2]
        element = vector.type.element
        kind = ir.FunctionType(element, [element, vector.type])
        name = f"llvm.vector.reduce.fadd.v{vector.type.count}{element.intrinsic_name}"
        function = cgutils.get_or_insert_function(builder.module, kind, name)
        total = builder.call(function, [ir.Constant(element, 0.0), vector], fastmath=FLAGS)
        _add(context, builder, array, args[0], args[1], total)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), gen


@intrinsic
def add_each(typing, array, i, lanes, count):
    """array[i + lane] += lanes, atomically, for the first `count` lanes."""

    def gen(context, builder, sig, args):
        flat, i, vector, count = args
        for lane in range(vector.type.count):
            number = ir.Constant(ir.IntType(64), lane)
            with builder.if_then(builder.icmp_signed("<", number, count)):
                value = builder.extract_element(vector, ir.Constant(ir.IntType(32), lane))
                _add(context, builder, array, flat, builder.add(i, number), value)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes, types.intp), gen


def _add(context, builder, kind, array, i, value) -> None:
    data = context.make_array(kind)(context, builder, array).data
    builder.atomic_rmw("fadd", builder.gep(data, [i]), value, "monotonic")


@cache
def make_scatter(lanes: int, dim: int):
    """Sums a_ij p_j of a fluid without boundary into `pull` (n,), each pair of groups once. `ones` holds as many ones as
    zeros after them, one for each lane. The lists of a group are in the order of rows."""
    L, DIM, P = lanes, dim, dim
    weight = make_weight(lanes, dim, False)

    @compiled(lanes, dim)
    def scatter(counter, bounds, groups, field, pull, ones, k):
        offset, count, group, span, list_offset, steps = groups
        while True:
            c = claim(counter)
            if c >= bounds.size - 1:
                break
            base = list_offset[c]
            for g in range(offset[c], offset[c] + count[c]):
                s, e = group[g], group[g + 1]
                x_i, nothing = own_vector(field, s, 0, L, DIM), zero(field, L)
                p_i = own(field, s, P, L) * load(ones, L - (e - s), L)
                total = zero(field, L)
                j = span[g, ROW]
                for n in range(base + span[g, 0], base + span[g, 1]):
                    j += at(steps, n)
                    if j < s:
                        continue
                    a = weight(field, x_i, nothing, j, k)
                    total = total + a * other(field, j, P, L)
                    if j >= e:
                        add_sum(pull, j, a * p_i)
                add_each(pull, s, total, e - s)

    return scatter


@compiled()
def finish(counter, bounds, new, column, coefficients, pull, factor):
    """The rest of a Jacobi sweep."""
    while True:
        c = claim(counter)
        if c >= bounds.size - 1:
            break
        for i in range(bounds[c], bounds[c + 1]):
            new[i, column] = (factor * pull[i] - coefficients[i, SOURCE]) / coefficients[i, DIAGONAL]
            pull[i] = 0.0


def cost_of_order(particles: int, rounds: int) -> list[dict]:
    """Nanoseconds per particle of a pressure sweep in a fixed order and of one without, on one thread, in turns, and the
    largest difference of the pressures over the largest pressure."""
    block, team = Block(3, particles), Team(1)
    block.step()
    fluid, n = block.fluid, block.fluid.count
    near, rows = neighbours(fluid)
    field = np.zeros((n + W, 4), np.float32)
    field[:, :3] = rows.T
    field[:n, 3] = np.random.default_rng(1).uniform(0.5, 1.0, n)
    new, other_new, coefficients = field.copy(), field.copy(), np.ones((n, 4), np.float32)
    pull, ones = np.zeros(n, np.float32), np.repeat(np.float32([1, 0]), fluid.lanes)
    none, sweep, scatter = (
        LinearResponse.none(3, np.float32),
        make_sweep(fluid.lanes, 3, False),
        make_scatter(fluid.lanes, 3),
    )

    def ordered() -> None:
        team.run(
            sweep, near.bounds, near.groups, field, new, coefficients, fluid.k, np.float32(1), np.float32(0), none.rows,
            none.twin, none.low, none.high,
        )  # fmt: skip

    def unordered() -> None:
        team.run(scatter, near.bounds, near.groups, field, pull, ones, fluid.k)
        team.run(finish, near.bounds, other_new, 3, coefficients, pull, fluid.k.laplacian_factor)

    taken = {ordered: [], unordered: []}
    for turn in range(rounds + 1):
        for work, samples in taken.items():
            start = time.process_time()
            work()
            samples += [time.process_time() - start] if turn else []
    difference = float(np.abs(new[:n, 3] - other_new[:n, 3]).max() / np.abs(new[:n, 3]).max())
    names = {ordered: "both sides of a pair, in the order of the lists", unordered: "each pair once, atomic additions"}
    return [
        {"sweep": names[work], "ns_per_particle": 1e9 * median(samples) / n, "difference": difference}
        for work, samples in taken.items()
    ]
