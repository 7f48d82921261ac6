"""Vector lanes for numba: the pair terms read as plain arithmetic and run on a whole group of particles at once.

`Lanes` holds one number for each of the `n` particles of a group; `Spatial` holds one vector of `dim` components for
each. Both support + - * /, with scalars where that makes sense; `dot`, `sqrt`, `maximum` and `minimum` complete them.
Particle data lies in packed rows, arrays (particles, components): `own_*` reads the lanes of a group from consecutive
rows, `other_*` gives one neighbour's numbers to all lanes. Indices must not be negative.
"""

from __future__ import annotations

import math
import operator

import numpy as np
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import populate_array

RELAXED = ("contract", "nsz", "arcp", "nnan", "ninf", "reassoc")  # float rules of the pair sums
I32, I64 = ir.IntType(32), ir.IntType(64)


class Lanes(types.Type):
    """One number of type `dtype` for each of n lanes."""

    def __init__(self, dtype, n):
        self.dtype, self.n = dtype, n
        super().__init__(name=f"Lanes({dtype}, {n})")


class Spatial(types.Type):
    """One vector of `dim` components for each lane."""

    def __init__(self, lanes, dim):
        self.lanes, self.dim = lanes, dim
        super().__init__(name=f"Spatial({lanes}, {dim})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager, fe):
        super().__init__(manager, fe, ir.VectorType(manager.lookup(fe.dtype).get_value_type(), fe.n))


@register_model(Spatial)
class _SpatialModel(models.PrimitiveModel):
    def __init__(self, manager, fe):
        super().__init__(manager, fe, ir.ArrayType(manager.lookup(fe.lanes).get_value_type(), fe.dim))


# ---------------------------------------------------------------------------------------------- arithmetic


def _splat(builder, scalar, n):
    vector = ir.VectorType(scalar.type, n)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, ir.Constant(I32, 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(I32, n), [0] * n))


def _per_component(builder, op, a, b):
    """op on each component; a Lanes operand serves every component."""
    of = lambda x, d: builder.extract_value(x, d) if isinstance(x.type, ir.ArrayType) else x  # noqa: E731
    shape = a.type if isinstance(a.type, ir.ArrayType) else b.type
    out = ir.Constant(shape, ir.Undefined)
    for d in range(shape.count):
        out = builder.insert_value(out, op(of(a, d), of(b, d)), d)
    return out


def _result(op, a, b):
    """Type of `a op b`, or None: Lanes with Lanes, Spatial +- Spatial, Spatial */ Lanes, and scalars as Lanes."""
    vectors = isinstance(a, Spatial) + isinstance(b, Spatial)
    if vectors == 2:
        return a if a == b and op in (operator.add, operator.sub) else None
    if vectors == 1:
        factor = b if isinstance(a, Spatial) else a
        vector = a if isinstance(a, Spatial) else b
        scales = op is operator.mul or (op is operator.truediv and vector is a)
        return vector if scales and isinstance(factor, (Lanes, types.Number)) else None
    if isinstance(a, Lanes) and (a == b or isinstance(b, types.Number)):
        return a
    return b if isinstance(b, Lanes) and isinstance(a, types.Number) else None


def _as_lanes(context, builder, value, ty, lanes):
    """A scalar becomes lanes of the other operand's type."""
    if not isinstance(ty, types.Number):
        return value
    return _splat(builder, context.cast(builder, value, ty, lanes.dtype), lanes.n)


for _op, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv")):

    @infer_global(_op)
    class _Typing(AbstractTemplate):
        python_op = staticmethod(_op)

        def generic(self, args, kws):
            if len(args) == 2 and any(isinstance(a, (Lanes, Spatial)) for a in args):
                out = _result(self.python_op, *args)
                return signature(out, *args) if out else None

    def _lower(context, builder, sig, args, name=_name):
        lanes = sig.return_type.lanes if isinstance(sig.return_type, Spatial) else sig.return_type
        a, b = (_as_lanes(context, builder, v, t, lanes) for v, t in zip(args, sig.args, strict=True))
        op = lambda x, y: getattr(builder, name)(x, y, flags=RELAXED)  # noqa: E731
        if isinstance(sig.return_type, Spatial):
            return _per_component(builder, op, a, b)
        return op(a, b)

    for _a in (Lanes, Spatial, types.Number):
        for _b in (Lanes, Spatial, types.Number):
            if types.Number is not _a or types.Number is not _b:
                lower_builtin(_op, _a, _b)(_lower)


def _lane_op(function):
    """An intrinsic with a stable identity; without one, numba's disk cache misses in every process."""
    op = intrinsic(prefer_literal=True)(function)
    op._set_uuid("fsi.compute.lanes." + function.__name__)
    return op


def _call(builder, name, result, args, **options):
    kind = ir.FunctionType(result, [a.type for a in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args, **options)


@_lane_op
def dot(typing, a, b):
    """Scalar product of two Spatial, lane by lane; of two numbers, vectors on a line, their product."""
    if isinstance(a, types.Number):
        return _numbers(a, b)(a, b), _on_numbers("fmul")

    def gen(context, builder, sig, args):
        total = None
        for d in range(a.dim):
            term = builder.fmul(*(builder.extract_value(v, d) for v in args), flags=RELAXED)
            total = term if total is None else builder.fadd(total, term, flags=RELAXED)
        return total

    return a.lanes(a, b), gen


def _numbers(a, b):
    """The float type of two numbers."""
    return types.float32 if types.float64 not in (a, b) and types.float32 in (a, b) else types.float64


def _cast(context, builder, sig, args):
    return (context.cast(builder, v, t, sig.return_type) for v, t in zip(args, sig.args, strict=True))


def _on_numbers(name):
    return lambda context, builder, sig, args: getattr(builder, name)(
        *_cast(context, builder, sig, args), flags=RELAXED
    )


@_lane_op
def component(typing, a, d):
    """Component d (a constant) of a Spatial."""
    return a.lanes(a, d), lambda context, builder, sig, args: builder.extract_value(args[0], d.literal_value)


@_lane_op
def sqrt(typing, a):
    """Of lanes or of a number."""

    def gen(context, builder, sig, args):
        if isinstance(a, types.Number):
            (value,) = _cast(context, builder, sig, args)
            name = f"llvm.sqrt.{value.type.intrinsic_name}"
            return _call(builder, name, value.type, (value,), fastmath=RELAXED)
        kind = args[0].type
        name = f"llvm.sqrt.v{kind.count}{kind.element.intrinsic_name}"
        return _call(builder, name, kind, args, fastmath=RELAXED)

    return (_numbers(a, a) if isinstance(a, types.Number) else a)(a), gen


def _select(comparison):
    def gen(context, builder, sig, args):
        if isinstance(sig.return_type, types.Number):
            x, y = _cast(context, builder, sig, args)
        else:
            lanes = sig.return_type
            x, y = (_as_lanes(context, builder, v, t, lanes) for v, t in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered(comparison, x, y, flags=RELAXED), x, y)

    return gen


def _larger_type(a, b):
    return next((t for t in (a, b) if isinstance(t, Lanes)), None) or _numbers(a, b)


@_lane_op
def maximum(typing, a, b):
    """Of lanes, of lanes and a number, or of numbers."""
    return _larger_type(a, b)(a, b), _select(">")


@_lane_op
def minimum(typing, a, b):
    """Of lanes, of lanes and a number, or of numbers."""
    return _larger_type(a, b)(a, b), _select("<")


# ---------------------------------------------------------------------------------------------- loads and stores


def _pointer(context, builder, ty, array, index, offset=0):
    """Address of element (index, offset) of a packed row, or `index` of a flat array."""
    struct = context.make_array(ty)(context, builder, array)
    if ty.ndim == 2:
        index = builder.mul(index, cgutils.unpack_tuple(builder, struct.shape)[1])
    return builder.gep(struct.data, [builder.add(index, ir.Constant(I64, offset))])


@_lane_op
def zero(typing, rows, n):
    """Lanes of zeros of the type of `rows`."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, n), lambda context, builder, sig, args: ir.Constant(context.get_value_type(kind), None)


@_lane_op
def zero_vector(typing, rows, n, dim):
    """Spatial of zeros of the type of `rows`."""
    kind = Spatial(Lanes(rows.dtype, n.literal_value), dim.literal_value)
    return kind(rows, n, dim), lambda context, builder, sig, args: ir.Constant(context.get_value_type(kind), None)


def _load_other(context, builder, ty, args, offset, n):
    return _splat(builder, builder.load(_pointer(context, builder, ty, args[0], args[1], offset)), n)


@_lane_op
def other(typing, rows, j, c, n):
    """rows[j, c] in all lanes."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, types.intp, c, n), lambda context, builder, sig, args: _load_other(
        context, builder, rows, args, c.literal_value, kind.n
    )


@_lane_op
def other_vector(typing, rows, j, c, n, dim):
    """rows[j, c : c + dim] in all lanes."""
    kind = Spatial(Lanes(rows.dtype, n.literal_value), dim.literal_value)

    def gen(context, builder, sig, args):
        out = ir.Constant(context.get_value_type(kind), ir.Undefined)
        for d in range(kind.dim):
            value = _load_other(context, builder, rows, args, c.literal_value + d, kind.lanes.n)
            out = builder.insert_value(out, value, d)
        return out

    return kind(rows, types.intp, c, n, dim), gen


def _load_own(context, builder, ty, args, offset, n):
    struct = context.make_array(ty)(context, builder, args[0])
    stride = cgutils.unpack_tuple(builder, struct.shape)[1]
    pointer = _pointer(context, builder, ty, args[0], args[1], offset)
    out = ir.Constant(ir.VectorType(pointer.type.pointee, n), ir.Undefined)
    for lane in range(n):
        out = builder.insert_element(out, builder.load(pointer), ir.Constant(I32, lane))
        pointer = builder.gep(pointer, [stride])
    return out


@_lane_op
def own(typing, rows, i, c, n):
    """rows[i + lane, c] for each lane."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, types.intp, c, n), lambda context, builder, sig, args: _load_own(
        context, builder, rows, args, c.literal_value, kind.n
    )


@_lane_op
def own_vector(typing, rows, i, c, n, dim):
    """rows[i + lane, c : c + dim] for each lane."""
    kind = Spatial(Lanes(rows.dtype, n.literal_value), dim.literal_value)

    def gen(context, builder, sig, args):
        out = ir.Constant(context.get_value_type(kind), ir.Undefined)
        for d in range(kind.dim):
            value = _load_own(context, builder, rows, args, c.literal_value + d, kind.lanes.n)
            out = builder.insert_value(out, value, d)
        return out

    return kind(rows, types.intp, c, n, dim), gen


def _store(context, builder, ty, array, index, vector):
    pointer = _pointer(context, builder, ty, array, index)
    builder.store(vector, builder.bitcast(pointer, vector.type.as_pointer()), align=ty.dtype.bitwidth // 8)


@_lane_op
def store(typing, array, i, value):
    """array[i : i + n] = lanes, for a flat array; a Spatial is stored component after component."""

    def gen(context, builder, sig, args):
        if isinstance(value, Lanes):
            _store(context, builder, array, args[0], args[1], args[2])
        else:
            for d in range(value.dim):
                at = builder.add(args[1], ir.Constant(I64, d * value.lanes.n))
                _store(context, builder, array, args[0], at, builder.extract_value(args[2], d))
        return context.get_dummy_value()

    return types.void(array, types.intp, value), gen


@_lane_op
def load(typing, array, i, n):
    """array[i : i + n] of a flat array."""
    kind = Lanes(array.dtype, n.literal_value)

    def gen(context, builder, sig, args):
        pointer = _pointer(context, builder, array, args[0], args[1])
        vector = context.get_value_type(kind).as_pointer()
        return builder.load(builder.bitcast(pointer, vector), align=array.dtype.bitwidth // 8)

    return kind(array, types.intp, n), gen


@_lane_op
def at(typing, array, i):
    """array[i] of an array of non-negative int32 as an index, without the wrap-around of negative indices."""

    def gen(context, builder, sig, args):
        return builder.zext(builder.load(_pointer(context, builder, array, args[0], args[1])), I64)

    return types.intp(array, types.intp), gen


# ---------------------------------------------------------------------------------------------- sums of a group


def _parts(sums):
    """Type, first number and lanes of each part of a tuple of Lanes and Spatial, laid one after the other."""
    first = 0
    for part in sums:
        lanes = part.lanes if isinstance(part, Spatial) else part
        yield part, first, lanes
        first += lanes.n * (part.dim if isinstance(part, Spatial) else 1)


@_lane_op
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


@_lane_op
def small(typing, n):
    """n doubles on the stack, a constant; they hold anything, and must not outlive the function."""
    out = types.Array(types.float64, 1, "C")
    return out(n), lambda context, builder, sig, args: _stack_array(context, builder, out, n.literal_value)


@_lane_op
def small_matrix(typing, n, m):
    """The same for n x m doubles."""
    out, shape = types.Array(types.float64, 2, "C"), (n.literal_value, m.literal_value)
    return out(n, m), lambda context, builder, sig, args: _stack_array(context, builder, out, *shape)


@_lane_op
def store_all(typing, array, sums):
    """A tuple of Lanes and Spatial into a flat array, one after the other."""

    def gen(context, builder, sig, args):
        for p, (part, first, lanes) in enumerate(_parts(sums)):
            value = builder.extract_value(args[1], p)
            if isinstance(part, Lanes):
                _store(context, builder, array, args[0], ir.Constant(I64, first), value)
                continue
            for d in range(part.dim):
                place = ir.Constant(I64, first + d * lanes.n)
                _store(context, builder, array, args[0], place, builder.extract_value(value, d))
        return context.get_dummy_value()

    return types.void(array, sums), gen


@_lane_op
def lane_of(typing, array, lane, sums):
    """One lane of what `store_all` left of such a tuple: numbers, and tuples of numbers for vectors."""
    kinds = [types.UniTuple(a.dtype, p.dim) if isinstance(p, Spatial) else a.dtype for p, _, a in _parts(sums)]
    out = types.Tuple(kinds)

    def gen(context, builder, sig, args):
        flat, lane, _ = args
        read = lambda first: builder.load(_pointer(context, builder, array, flat, lane, first))  # noqa: E731
        values = []
        for kind, (_, first, lanes) in zip(kinds, _parts(sums), strict=True):
            if isinstance(kind, types.UniTuple):
                numbers = [read(first + d * lanes.n) for d in range(kind.count)]
                values.append(context.make_tuple(builder, kind, numbers))
            else:
                values.append(read(first))
        return context.make_tuple(builder, out, values)

    return out(array, types.intp, sums), gen


# ---------------------------------------------------------------------------------------------- compaction, claims


@_lane_op
def bits_below(typing, x, y):
    """Bit mask of the lanes with x < y."""

    def gen(context, builder, sig, args):
        b = _as_lanes(context, builder, args[1], y, x)
        mask = builder.fcmp_ordered("<", args[0], b, flags=RELAXED)
        return builder.zext(builder.bitcast(mask, ir.IntType(x.n)), I64)

    return types.intp(x, y), gen


@_lane_op
def count_bits(typing, mask):
    return types.intp(types.intp), lambda context, builder, sig, args: builder.ctpop(args[0])


@_lane_op
def consecutive(typing, first, n):
    """int32 lanes first, first + 1, ..."""
    kind = Lanes(types.int32, n.literal_value)

    def gen(context, builder, sig, args):
        steps = ir.Constant(ir.VectorType(I32, kind.n), list(range(kind.n)))
        return builder.add(_splat(builder, builder.trunc(args[0], I32), kind.n), steps)

    return kind(types.intp, n), gen


def _has_avx2():
    return bool(get_host_cpu_features().get("avx2"))


def width(dtype) -> int:
    """Lanes of this type that fill a vector register of this processor, at least 32 bytes."""
    size = 64 if get_host_cpu_features().get("avx512f") else 32
    return size // np.dtype(dtype).itemsize


def _packing_order(builder, mask):
    """For each mask of eight lanes, the lanes whose bit is set, first to last: a row of a constant table."""
    row = ir.ArrayType(I32, 8)
    rows = []
    for m in range(256):
        bits = [lane for lane in range(8) if m >> lane & 1]
        rows.append(ir.Constant(row, bits + [0] * (8 - len(bits))))
    table = cgutils.global_constant(builder, "fsi.compute.lanes.packing", ir.Constant(ir.ArrayType(row, 256), rows))
    pointer = builder.gep(table, [ir.Constant(I64, 0), mask])
    return builder.load(builder.bitcast(pointer, ir.VectorType(I32, 8).as_pointer()), align=4)


@_lane_op
def append(typing, array, k, value, mask):
    """Write the lanes of `value` whose bit is set to array[k], array[k + 1], ...; up to n places are overwritten."""

    def gen(context, builder, sig, args):
        flat, k, vector, mask = args
        if value.n == 8 and value.dtype.bitwidth == 32 and _has_avx2():
            order = _packing_order(builder, mask)
            name = "llvm.x86.avx2.permd" if value.dtype == types.int32 else "llvm.x86.avx2.permps"
            _store(context, builder, array, flat, k, _call(builder, name, vector.type, (vector, order)))
            return context.get_dummy_value()
        for lane in range(value.n):  # without branches: a lane that is not set is overwritten by the next
            element = builder.extract_element(vector, ir.Constant(I32, lane))
            builder.store(element, _pointer(context, builder, array, flat, k))
            bit = builder.and_(builder.lshr(mask, ir.Constant(I64, lane)), ir.Constant(I64, 1))
            k = builder.add(k, bit)
        return context.get_dummy_value()

    return types.void(array, types.intp, value, types.intp), gen


@_lane_op
def claim(typing, counter):
    """counter[0] before adding one to it, atomically: the next piece of work for this thread."""

    def gen(context, builder, sig, args):
        pointer = _pointer(context, builder, counter, args[0], ir.Constant(I64, 0))
        return builder.atomic_rmw("add", pointer, ir.Constant(I64, 1), "monotonic")

    return types.intp(counter), gen
