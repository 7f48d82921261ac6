"""Each pair term on lanes and on scalars."""

import inspect

import numpy as np
import pytest
from numba import njit

from fsi.compute.lanes import other, other_vector, store
from fsi.sph import terms

LANES = 4
VECTORS = ("x_ij", "u_ij")
TERMS = list(dict.fromkeys(f for f in vars(terms).values() if inspect.isfunction(f) and f.__module__ == terms.__name__))


def caller(term):
    """The term on lanes, from the numbers of a row, one for each of its arguments; vectors have one component."""
    names = list(inspect.signature(term).parameters)
    loads = ", ".join(
        f"other_vector(rows, 0, {c}, LANES, 1)" if n in VECTORS else f"other(rows, 0, {c}, LANES)"
        for c, n in enumerate(names)
    )
    scope = {"term": term, "other": other, "other_vector": other_vector, "store": store, "LANES": LANES}
    exec(f"def on_lanes(rows, out):\n    store(out, 0, term({loads}))", scope)
    exec(f"def on_scalars(row):\n    return term({', '.join(f'row[{c}]' for c in range(len(names)))})", scope)
    return njit(scope["on_lanes"]), njit(scope["on_scalars"]), len(names)


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.__name__)
def test_a_term_is_the_same_on_lanes_and_on_scalars(term):
    on_lanes, on_scalars, count = caller(term)
    rng, out = np.random.default_rng(2), np.zeros(LANES)
    for _ in range(20):
        rows = rng.uniform(-1.0, 1.0, (1, count)) if count > 4 else rng.uniform(0.05, 1.0, (1, count))
        on_lanes(rows, out)
        assert out == pytest.approx(np.full(LANES, on_scalars(rows[0])), rel=1e-13, abs=1e-15)
