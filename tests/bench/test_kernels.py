"""The table of the kernels, and the verdict on two checkouts."""

import numpy as np
import pytest

from cases.bench.kernels import verdict
from cases.bench.report import kernel_table


def test_the_table_has_a_row_for_each_kernel():
    rows = [
        {"trial": "flap", "kernel": "sweep", "ns": 75.5, "verdict": "same bits", "particles": 4470},
        {"trial": "flap", "kernel": "press", "ns": 10.6, "verdict": "same bits", "particles": 1327},
    ]
    table = kernel_table(rows)
    assert table.heads == ["scene", "kernel", "particles", "ns per particle"]
    assert table.cells == [["flap", "sweep", "4470", "75.5"], ["flap", "press", "1327", "10.6"]]


@pytest.mark.parametrize(
    "before, after, expected",
    [
        (([0.0, 5.0], [0.0, 5.0]), ([1.0, 5.0], [1.0, 5.0]), "same bits"),
        (([0.0, 5.0], [0.0, 6.0]), ([1.0, 5.0], [1.0, 6.0]), "same bits"),  # what no call changes may be anything
        (
            ([1.0, 5.0], [0.0, 5.0]),
            ([1.0, 5.0], [1.0, 5.0]),
            "same bits",
        ),  # changed in one: it happened to be right there
        (([1.0], [1.0]), ([0.0], [-0.0]), "same values"),
        (([1.0], [1.0]), ([2.0], [2.0 + 1e-15]), "DIFFERENT"),
        (([1.0], [1.0]), ([np.nan], [np.nan]), "same bits"),
    ],
)
def test_the_verdict_is_on_what_either_call_changes(before, after, expected):
    one, two = ([np.array(b), np.array(a)] for b, a in zip(before, after, strict=True))
    assert verdict(one, two) == expected
