"""The lane type against numpy, lane by lane."""

import numpy as np
import pytest
from numba import njit

from fsi.compute.compact import append, bits_below, consecutive
from fsi.compute.lanes import (
    component,
    dot,
    load,
    maximum,
    minimum,
    other,
    other_vector,
    own,
    own_vector,
    sqrt,
    store,
    zero,
    zero_vector,
)


def arithmetic(lanes, dim):
    @njit(error_model="numpy")
    def sums(rows, out):
        x, weight = own_vector(rows, 1, 0, lanes, dim), own(rows, 1, dim, lanes)
        total, force = zero(rows, lanes), zero_vector(rows, lanes, dim)
        for j in range(rows.shape[0]):
            d = x - other_vector(rows, j, 0, lanes, dim)
            t = maximum(0.0, 1.0 - 0.5 * sqrt(dot(d, d))) / (2 + weight)
            total = total + minimum(t, 0.3) * other(rows, j, dim, lanes)
            force = force + t * d / 2.0 - component(d, 0) * (d * 3)
        store(out, 0, total)
        store(out, lanes, force)

    return sums


@pytest.mark.parametrize("dtype, lanes, tolerance", [(np.float32, 8, 2e-5), (np.float64, 4, 1e-13)])
@pytest.mark.parametrize("dim", [2, 3])
def test_arithmetic(dtype, lanes, tolerance, dim):
    rows = np.random.default_rng(1).random((30, dim + 2)).astype(dtype)
    out = np.zeros((1 + dim) * lanes, dtype)
    arithmetic(lanes, dim)(rows, out)
    for lane in range(lanes):
        d = rows[1 + lane, :dim].astype(float) - rows[:, :dim]
        t = np.maximum(0, 1 - 0.5 * np.sqrt((d**2).sum(1))) / (2 + rows[1 + lane, dim])
        assert out[lane] == pytest.approx((np.minimum(t, 0.3) * rows[:, dim]).sum(), rel=tolerance)
        force = (t[:, None] * d / 2 - d[:, :1] * d * 3).sum(0)
        assert out[lanes + lane :: lanes] == pytest.approx(force, rel=20 * tolerance, abs=20 * tolerance)


@njit
def pack(source, limit, out, numbers):
    hits = bits_below(load(source, 0, 8), limit)
    append(out, 1, load(source, 0, 8), hits)
    append(numbers, 1, consecutive(40, 8), hits)
    return hits


@pytest.mark.parametrize("seed", range(5))
def test_append_packs_the_chosen_lanes(seed):
    source = np.random.default_rng(seed).random(8).astype(np.float32)
    out, numbers = np.zeros(16, np.float32), np.zeros(16, np.int32)
    pack(source, 0.5, out, numbers)
    chosen = np.flatnonzero(source < 0.5)
    assert (out[1 : 1 + len(chosen)] == source[chosen]).all()
    assert (numbers[1 : 1 + len(chosen)] == 40 + chosen).all()
