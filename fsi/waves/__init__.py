"""Waves: linear theory, and the motion of the piston for each kind of `fsi.scene.waves`.

A motion is a pure function of time, t -> (displacement [m], velocity [m/s], acceleration [m/s2]), positive towards the
water and zero at t = 0, and tells by `reach` the least and the largest displacement [m]. A kind is imported on use.
"""

from __future__ import annotations

import math
from typing import Protocol

from fsi.waves.linear import piston_transfer, wavenumber
from fsi.waves.regular import RegularPiston, order_of, second_order_stroke
from fsi.waves.table import TablePiston, read_motion_table

__all__ = [
    "Motion",
    "RegularPiston",
    "TablePiston",
    "piston",
    "piston_transfer",
    "reach",
    "read_motion_table",
    "wavenumber",
]


class Motion(Protocol):
    """The path of a piston."""

    reach: tuple[float, float]

    def __call__(self, t: float) -> tuple[float, float, float]: ...


def reach(waves, depth: float, g: float) -> tuple[float, float]:
    """The least and the largest displacement [m] of a scene's piston; with active absorption it may leave its path."""
    motion = piston(waves, depth, g)
    back, forth = motion.reach
    if waves.absorb:
        from fsi.simulation.absorber import room

        return back - room(motion), forth + room(motion)
    return back, forth


def piston(waves, depth: float, g: float) -> Motion:
    """The motion of the piston that a scene's `waves` asks for in water of this depth [m]."""
    if waves.kind == "table":
        return TablePiston(waves.file)
    if waves.kind == "irregular":
        from fsi.waves.irregular import irregular_piston

        return irregular_piston(waves, depth, g)
    if waves.kind == "solitary":
        from fsi.waves.solitary import SolitaryPiston

        return SolitaryPiston(waves.wave_height, depth, g, waves.theory, waves.start)
    if waves.kind == "packet":
        from fsi.waves.packet import PacketPiston

        return PacketPiston([(w.wave_height, w.period, w.waves) for w in waves.groups], depth, g, waves.start)
    omega = 2 * math.pi / waves.period
    k = wavenumber(omega, depth, g)
    stroke = waves.wave_height / piston_transfer(k * depth)
    second = second_order_stroke(waves.wave_height, k, depth) if order_of(waves, k, depth) == 2 else 0.0
    return RegularPiston(stroke, omega, 2 * waves.period if waves.ramp is None else waves.ramp, second)
