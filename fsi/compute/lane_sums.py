"""The sums of a group, from lanes to the numbers of each particle, and small arrays on the stack.

`room_for` makes the room, `store_all` fills it, `lane_of` reads one particle's numbers. Arrays on the stack cost nothing and
are counted by nobody, so that kernels that allocate nothing can use them (`fsi.compute.pairs`).
"""

from __future__ import annotations

import math

from llvmlite import ir
from numba.core import cgutils, types
from numba.np.arrayobj import populate_array

from fsi.compute.lanes import I64, Lanes, Spatial, lane_op, per_component, pointer, store_lanes


def _parts(sums):
    """Type, first number and lanes of each part of a tuple of Lanes and Spatial, laid one after the other."""
    first = 0
    for part in sums:
        lanes = part.lanes if isinstance(part, Spatial) else part
        yield part, first, lanes
        first += lanes.n * (part.dim if isinstance(part, Spatial) else 1)


@lane_op
def room_for(typing, sums):
    """A flat array on the stack for `store_all` of such a tuple."""
    numbers = sum(part.lanes.n * part.dim if isinstance(part, Spatial) else part.n for part in sums)
    (_, _, lanes), *_ = _parts(sums)
    out = types.Array(lanes.dtype, 1, "C")

    def gen(context, builder, sig, args):
        return _stack_array(context, builder, out, numbers)

    return out(sums), gen


def _stack_array(context, builder, kind, *shape):
    """An array of this type that nobody counts references to."""
    element = context.get_value_type(kind.dtype)
    data = cgutils.alloca_once(builder, element, size=math.prod(shape))
    array = context.make_array(kind)(context, builder)
    itemsize = context.get_abi_sizeof(element)
    steps = [itemsize * math.prod(shape[d + 1 :]) for d in range(len(shape))]
    constants = lambda values: [ir.Constant(I64, value) for value in values]  # noqa: E731
    item = ir.Constant(I64, itemsize)
    populate_array(array, data=data, shape=constants(shape), strides=constants(steps), itemsize=item, meminfo=None)
    return array._getvalue()


@lane_op
def plus(typing, a, b):
    """The sum of two doubles, lanes or vectors, not to be reordered with others: a loop of such sums adds in the order of its
    terms, where the compiler would else add several of them first in a short loop that it unrolls. The flag keeps numba from
    allowing more."""
    out = a if isinstance(a, Lanes | Spatial) else types.float64
    op = lambda builder, x, y: builder.fadd(x, y, flags=("nsz", "contract"))  # noqa: E731

    def gen(context, builder, sig, args):
        if isinstance(out, Spatial):
            return per_component(builder, lambda x, y: op(builder, x, y), *args)
        return op(builder, *args)

    return out(out, out), gen


@lane_op
def small(typing, n):
    """n doubles on the stack, a constant; they hold anything, and must not outlive the function."""
    out = types.Array(types.float64, 1, "C")
    return out(n), lambda context, builder, sig, args: _stack_array(context, builder, out, n.literal_value)


@lane_op
def small_matrix(typing, n, m):
    """The same for n x m doubles."""
    out, shape = types.Array(types.float64, 2, "C"), (n.literal_value, m.literal_value)
    return out(n, m), lambda context, builder, sig, args: _stack_array(context, builder, out, *shape)


@lane_op
def store_all(typing, array, sums):
    """A tuple of Lanes and Spatial into a flat array, one after the other."""

    def gen(context, builder, sig, args):
        for p, (part, first, lanes) in enumerate(_parts(sums)):
            value = builder.extract_value(args[1], p)
            if isinstance(part, Lanes):
                store_lanes(context, builder, array, args[0], ir.Constant(I64, first), value)
                continue
            for d in range(part.dim):
                place = ir.Constant(I64, first + d * lanes.n)
                store_lanes(context, builder, array, args[0], place, builder.extract_value(value, d))
        return context.get_dummy_value()

    return types.void(array, sums), gen


@lane_op
def lane_of(typing, array, lane, sums):
    """One lane of what `store_all` left of such a tuple: numbers, and tuples of numbers for vectors."""
    kinds = [types.UniTuple(a.dtype, p.dim) if isinstance(p, Spatial) else a.dtype for p, _, a in _parts(sums)]
    out = types.Tuple(kinds)

    def gen(context, builder, sig, args):
        flat, lane, _ = args
        read = lambda first: builder.load(pointer(context, builder, array, flat, lane, first))  # noqa: E731
        values = []
        for kind, (_, first, lanes) in zip(kinds, _parts(sums), strict=True):
            if isinstance(kind, types.UniTuple):
                numbers = [read(first + d * lanes.n) for d in range(kind.count)]
                values.append(context.make_tuple(builder, kind, numbers))
            else:
                values.append(read(first))
        return context.make_tuple(builder, out, values)

    return out(array, types.intp, sums), gen
