"""Compaction: lanes that pass a test are written one after the other, as the search for neighbours does."""

from __future__ import annotations

from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils, types

from fsi.compute.lanes import I32, I64, RELAXED, Lanes, as_lanes, call, lane_op, pointer, splat, store_lanes


@lane_op
def bits_below(typing, x, y):
    """Bit mask of the lanes with x < y."""

    def gen(context, builder, sig, args):
        b = as_lanes(context, builder, args[1], y, x)
        mask = builder.fcmp_ordered("<", args[0], b, flags=RELAXED)
        return builder.zext(builder.bitcast(mask, ir.IntType(x.n)), I64)

    return types.intp(x, y), gen


@lane_op
def count_bits(typing, mask):
    return types.intp(types.intp), lambda context, builder, sig, args: builder.ctpop(args[0])


@lane_op
def consecutive(typing, first, n):
    """int32 lanes first, first + 1, ..."""
    kind = Lanes(types.int32, n.literal_value)

    def gen(context, builder, sig, args):
        steps = ir.Constant(ir.VectorType(I32, kind.n), list(range(kind.n)))
        return builder.add(splat(builder, builder.trunc(args[0], I32), kind.n), steps)

    return kind(types.intp, n), gen


def _has_avx2():
    return bool(get_host_cpu_features().get("avx2"))


def _packing_order(builder, mask):
    """For each mask of eight lanes, the lanes whose bit is set, first to last: a row of a constant table."""
    row = ir.ArrayType(I32, 8)
    rows = []
    for m in range(256):
        bits = [lane for lane in range(8) if m >> lane & 1]
        rows.append(ir.Constant(row, bits + [0] * (8 - len(bits))))
    table = cgutils.global_constant(builder, "fsi.compute.lanes.packing", ir.Constant(ir.ArrayType(row, 256), rows))
    address = builder.gep(table, [ir.Constant(I64, 0), mask])
    return builder.load(builder.bitcast(address, ir.VectorType(I32, 8).as_pointer()), align=4)


@lane_op
def append(typing, array, k, value, mask):
    """Write the lanes of `value` whose bit is set to array[k], array[k + 1], ...; up to n places are overwritten."""

    def gen(context, builder, sig, args):
        flat, k, vector, mask = args
        if value.n == 8 and value.dtype.bitwidth == 32 and _has_avx2():
            order = _packing_order(builder, mask)
            name = "llvm.x86.avx2.permd" if value.dtype == types.int32 else "llvm.x86.avx2.permps"
            store_lanes(context, builder, array, flat, k, call(builder, name, vector.type, (vector, order)))
            return context.get_dummy_value()
        for lane in range(value.n):  # without branches: a lane that is not set is overwritten by the next
            element = builder.extract_element(vector, ir.Constant(I32, lane))
            builder.store(element, pointer(context, builder, array, flat, k))
            bit = builder.and_(builder.lshr(mask, ir.Constant(I64, lane)), ir.Constant(I64, 1))
            k = builder.add(k, bit)
        return context.get_dummy_value()

    return types.void(array, types.intp, value, types.intp), gen
