"""The scalars of the scheme, from a scene."""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.body_force import BodyForce
from fsi.fluid.chebyshev import SOUND, iteration
from fsi.fluid.volume import held
from fsi.particles.layout import Layout
from fsi.scene.model import Scene
from fsi.sph import kernel, wall_guard
from fsi.sph.columns import Constants

SEA = 2.0  # times what damps the slowest mode in a step, of a sea without bodies, beside `fsi.fluid.volume`
HEAD = 4.0  # spacings of water, up to whose pressure the rows under the surface count more than once


def density_relaxation(scene: Scene, depth: float) -> float:
    """gamma: the scene's, or as much as the slowest mode of the depth [m] damps in a step. Waves stir the particles, which then
    take more room, and the level of a sea without bodies is held by as much more as is stable under its crests."""
    if scene.numerics.density_relaxation is not None:
        return scene.numerics.density_relaxation
    if held(scene):
        from fsi.scene.geometry import incident_waves

        return SEA * _damping(scene, depth + incident_waves(scene).crest)
    return _damping(scene, depth)


def artificial_kind(scene: Scene) -> str:
    """Of what there is artificial viscosity, as `fsi.sph.predictor` has it: "none", "linear", "whole"."""
    if scene.numerics.artificial_viscosity == 0 or scene.gravity == 0:  # it acts by the speed of sound
        return "none"
    return "linear" if scene.numerics.velocity_reconstruction == "linear" else "whole"


def _damping(scene: Scene, depth: float) -> float:
    return iteration(scene.numerics).gain * (SOUND * scene.smoothing_length * math.pi / (2 * depth)) ** 2 / 2


def sweep_constants(scene: Scene, layout: Layout, dtype) -> Constants:
    """The scalars of the sweeps for a scene with this layout."""
    dim, dr, h, rho = scene.dimension, scene.spacing, scene.smoothing_length, scene.fluid.density
    depth, volume = layout.depth, layout.volume
    mass = rho * volume
    lattice = kernel.lattice(volume ** (1 / dim), h, dim)
    slope = float(kernel.gradient_factor(0.0, h, dim))
    numerics = scene.numerics
    sound = math.sqrt(scene.gravity * depth) / numerics.mach
    down = BodyForce(scene).uniform
    weight = math.hypot(*down)
    up = -down / weight if weight > 0 else np.eye(dim)[-1]
    values = Constants(
        inverse_support=0.5 / h,
        eta2=(0.1 * h) ** 2,
        density_factor=float(kernel.value(0.0, h, dim)) / lattice.density,
        divergence_factor=slope * volume,
        laplacian_factor=2 * slope * mass / rho**2,
        gradient_factor=slope * mass / rho**2,
        viscous_factor=2 * scene.fluid.kinematic_viscosity * slope * volume / lattice.second_moment,
        stress_factor=2 * slope * volume / rho / lattice.second_moment,
        artificial_factor=numerics.artificial_viscosity * sound * h * slope * volume,
        lattice_laplacian=2 * mass / rho**2 * lattice.laplacian,
        surface_factor=lattice.surface_factor,
        filled1=lattice.rows.filled[0],
        filled2=lattice.rows.filled[1],
        filled3=lattice.rows.filled[2],
        filled4=lattice.rows.filled[3],
        inside=lattice.inside,
        excess1=lattice.rows.excess[0],
        excess2=lattice.rows.excess[1],
        excess3=lattice.rows.excess[2],
        shallow=HEAD * rho * weight * dr if weight > 0 else 1e30,
        up_x=up[0],
        up_y=up[1] if dim == 3 else 0.0,
        up_z=up[-1],
        relaxation=density_relaxation(scene, depth),
        suction=1.0,
        draw=0.0,
        density=rho,
        mass=mass * (scene.tank.width if dim == 2 else 1.0),
        shifting=scene.shifting * h * h * slope * volume,
        guard_level=wall_guard.level(numerics.wall_guard),
        guard_reach2=(wall_guard.REACH * dr) ** -2,
        guard_piece=wall_guard.PIECE * dr,
        guard2=(1.1 * numerics.wall_guard * dr + 1.5 * numerics.courant * h) ** 2,  # and a long step on
    )
    return Constants(*(dtype(v) for v in values))


def impulse_units(scene: Scene, depth: float, mass: float) -> np.ndarray:
    """Units (6,) [N s, N m s] in which impulses on an owner are counted where sums must not depend on any order, powers of
    two: fine against that of a particle of this mass [kg] at the speed of long waves, with room for millions of them."""
    speed = max(math.sqrt(scene.gravity * depth), scene.spacing)
    side = max(b - a for a, b in zip(scene.tank.min, scene.tank.max, strict=True))
    unit = 2.0 ** (math.ceil(math.log2(mass * speed)) - 40)
    return unit * np.array([1.0, 1.0, 1.0, *[2.0 ** math.ceil(math.log2(max(side, 1.0)))] * 3])
