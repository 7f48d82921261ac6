"""The heave of a truncated cylinder by matched eigenfunctions, against a boundary element code and a known limit."""

import math

import pytest

from cases.validation.coupling import forced_heave as spar
from cases.validation.theory.truncated_cylinder import radiation


@pytest.mark.parametrize("omega", spar.COEFFICIENTS)
def test_the_spar_is_that_of_boundary_elements(omega):
    mass, damping = spar.COEFFICIENTS[omega]
    found = radiation(omega, spar.RADIUS, spar.DRAFT, spar.DEPTH)
    assert [1000 * value for value in found] == pytest.approx([mass, damping], rel=0.012)


def test_a_narrow_gap_is_squeezed_as_a_film():
    """Water under a flat bottom at a small height S moves outwards: pi a^4 / (8 S) of the added mass, to which what happens
    outside adds next to nothing where S is halved."""
    wide, narrow = (radiation(20.0, 1.0, 1.0 - gap, 1.0)[0] for gap in (0.02, 0.01))
    assert narrow - wide == pytest.approx(math.pi / 8 * (1 / 0.01 - 1 / 0.02), rel=0.05)
