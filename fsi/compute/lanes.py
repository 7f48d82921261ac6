"""Vector lanes for numba: the pair terms read as plain arithmetic and run on a whole group of particles at once.

`Lanes` holds one number for each of the `n` particles of a group; `Spatial` holds one vector of `dim` components for
each. Both support + - * /, with scalars where that makes sense; `dot`, `sqrt`, `maximum` and `minimum` complete them.
Particle data lies in packed rows, arrays (particles, components): `own_*` reads the lanes of a group from consecutive
rows, `other_*` gives one neighbour's numbers to all lanes. Indices must not be negative.
"""

from __future__ import annotations

import operator

import numpy as np
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

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


def splat(builder, scalar, n):
    vector = ir.VectorType(scalar.type, n)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, ir.Constant(I32, 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(I32, n), [0] * n))


def per_component(builder, op, a, b):
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


def as_lanes(context, builder, value, ty, lanes):
    """A scalar becomes lanes of the other operand's type."""
    if not isinstance(ty, types.Number):
        return value
    return splat(builder, context.cast(builder, value, ty, lanes.dtype), lanes.n)


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
        a, b = (as_lanes(context, builder, v, t, lanes) for v, t in zip(args, sig.args, strict=True))
        op = lambda x, y: getattr(builder, name)(x, y, flags=RELAXED)  # noqa: E731
        if isinstance(sig.return_type, Spatial):
            return per_component(builder, op, a, b)
        return op(a, b)

    for _a in (Lanes, Spatial, types.Number):
        for _b in (Lanes, Spatial, types.Number):
            if types.Number is not _a or types.Number is not _b:
                lower_builtin(_op, _a, _b)(_lower)


def lane_op(function):
    """An intrinsic with a stable identity; without one, numba's disk cache misses in every process."""
    op = intrinsic(prefer_literal=True)(function)
    op._set_uuid(f"{function.__module__}.{function.__name__}")
    return op


def call(builder, name, result, args, **options):
    kind = ir.FunctionType(result, [a.type for a in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args, **options)


@lane_op
def fence(typing, a):
    """The lanes or the number itself, not to be merged with what becomes of them: sums with it then have the same bits in every
    kernel, whatever else the kernel does with it."""

    def gen(context, builder, sig, args):
        kind = args[0].type
        name = f"v{kind.count}{kind.element.intrinsic_name}" if isinstance(a, Lanes) else kind.intrinsic_name
        return call(builder, f"llvm.arithmetic.fence.{name}", kind, args)

    return a(a), gen


@lane_op
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


@lane_op
def component(typing, a, d):
    """Component d (a constant) of a Spatial."""
    return a.lanes(a, d), lambda context, builder, sig, args: builder.extract_value(args[0], d.literal_value)


@lane_op
def sqrt(typing, a):
    """Of lanes or of a number."""

    def gen(context, builder, sig, args):
        if isinstance(a, types.Number):
            (value,) = _cast(context, builder, sig, args)
            name = f"llvm.sqrt.{value.type.intrinsic_name}"
            return call(builder, name, value.type, (value,), fastmath=RELAXED)
        kind = args[0].type
        name = f"llvm.sqrt.v{kind.count}{kind.element.intrinsic_name}"
        return call(builder, name, kind, args, fastmath=RELAXED)

    return (_numbers(a, a) if isinstance(a, types.Number) else a)(a), gen


def _select(comparison):
    def gen(context, builder, sig, args):
        if isinstance(sig.return_type, types.Number):
            x, y = _cast(context, builder, sig, args)
        else:
            lanes = sig.return_type
            x, y = (as_lanes(context, builder, v, t, lanes) for v, t in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered(comparison, x, y, flags=RELAXED), x, y)

    return gen


def _larger_type(a, b):
    return next((t for t in (a, b) if isinstance(t, Lanes)), None) or _numbers(a, b)


@lane_op
def maximum(typing, a, b):
    """Of lanes, of lanes and a number, or of numbers."""
    return _larger_type(a, b)(a, b), _select(">")


@lane_op
def minimum(typing, a, b):
    """Of lanes, of lanes and a number, or of numbers."""
    return _larger_type(a, b)(a, b), _select("<")


# ---------------------------------------------------------------------------------------------- loads and stores


def pointer(context, builder, ty, array, index, offset=0):
    """Address of element (index, offset) of a packed row, or `index` of a flat array."""
    struct = context.make_array(ty)(context, builder, array)
    if ty.ndim == 2:
        index = builder.mul(index, cgutils.unpack_tuple(builder, struct.shape)[1])
    return builder.gep(struct.data, [builder.add(index, ir.Constant(I64, offset))])


@lane_op
def zero(typing, rows, n):
    """Lanes of zeros of the type of `rows`."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, n), lambda context, builder, sig, args: ir.Constant(context.get_value_type(kind), None)


@lane_op
def zero_vector(typing, rows, n, dim):
    """Spatial of zeros of the type of `rows`."""
    kind = Spatial(Lanes(rows.dtype, n.literal_value), dim.literal_value)
    return kind(rows, n, dim), lambda context, builder, sig, args: ir.Constant(context.get_value_type(kind), None)


def _load_other(context, builder, ty, args, offset, n):
    return splat(builder, builder.load(pointer(context, builder, ty, args[0], args[1], offset)), n)


@lane_op
def other(typing, rows, j, c, n):
    """rows[j, c] in all lanes."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, types.intp, c, n), lambda context, builder, sig, args: _load_other(
        context, builder, rows, args, c.literal_value, kind.n
    )


@lane_op
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
    address = pointer(context, builder, ty, args[0], args[1], offset)
    out = ir.Constant(ir.VectorType(address.type.pointee, n), ir.Undefined)
    for lane in range(n):
        out = builder.insert_element(out, builder.load(address), ir.Constant(I32, lane))
        address = builder.gep(address, [stride])
    return out


@lane_op
def own(typing, rows, i, c, n):
    """rows[i + lane, c] for each lane."""
    kind = Lanes(rows.dtype, n.literal_value)
    return kind(rows, types.intp, c, n), lambda context, builder, sig, args: _load_own(
        context, builder, rows, args, c.literal_value, kind.n
    )


@lane_op
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


def store_lanes(context, builder, ty, array, index, vector):
    address = pointer(context, builder, ty, array, index)
    builder.store(vector, builder.bitcast(address, vector.type.as_pointer()), align=ty.dtype.bitwidth // 8)


@lane_op
def store(typing, array, i, value):
    """array[i : i + n] = lanes, for a flat array; a Spatial is stored component after component."""

    def gen(context, builder, sig, args):
        if isinstance(value, Lanes):
            store_lanes(context, builder, array, args[0], args[1], args[2])
        else:
            for d in range(value.dim):
                at = builder.add(args[1], ir.Constant(I64, d * value.lanes.n))
                store_lanes(context, builder, array, args[0], at, builder.extract_value(args[2], d))
        return context.get_dummy_value()

    return types.void(array, types.intp, value), gen


@lane_op
def load(typing, array, i, n):
    """array[i : i + n] of a flat array."""
    kind = Lanes(array.dtype, n.literal_value)

    def gen(context, builder, sig, args):
        address = pointer(context, builder, array, args[0], args[1])
        vector = context.get_value_type(kind).as_pointer()
        return builder.load(builder.bitcast(address, vector), align=array.dtype.bitwidth // 8)

    return kind(array, types.intp, n), gen


@lane_op
def at(typing, array, i):
    """array[i] of an array of non-negative whole numbers as an index, without the wrap-around of negative indices."""

    def gen(context, builder, sig, args):
        return builder.zext(builder.load(pointer(context, builder, array, args[0], args[1])), I64)

    return types.intp(array, types.intp), gen


# ---------------------------------------------------------------------------------------------- the processor, claims


def width(dtype) -> int:
    """Lanes of this type that fill a vector register of this processor, at least 32 bytes."""
    size = 64 if get_host_cpu_features().get("avx512f") else 32
    return size // np.dtype(dtype).itemsize


@lane_op
def claim(typing, counter):
    """counter[0] before adding one to it, atomically: the next piece of work for this thread."""

    def gen(context, builder, sig, args):
        address = pointer(context, builder, counter, args[0], ir.Constant(I64, 0))
        return builder.atomic_rmw("add", address, ir.Constant(I64, 1), "monotonic")

    return types.intp(counter), gen
