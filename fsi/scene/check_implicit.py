"""What a scene cannot have together with the solver `iisph`, and what only that one can have."""

from __future__ import annotations

from collections.abc import Iterator

from fsi.scene.model import Scene
from fsi.waves.kind import Fault

NARROWEST = 1.2  # smoothing length over spacing of the explicit solvers


def implicit_faults(scene: Scene) -> Iterator[Fault]:
    """What cannot work."""
    yield from _of_implicit(scene) if scene.numerics.solver == "iisph" else _of_others(scene)


def _of_implicit(scene: Scene) -> Iterator[Fault]:
    numerics, key = scene.numerics, "numerics.solver"
    other = "remove it, or use solver = 'chebyshev'"
    if scene.liquids:
        yield "liquids", "'iisph' has a single liquid", other
    if numerics.viscosity != "none":
        fault = "'iisph' has artificial viscosity and numerics.wall_friction alone"
        yield "numerics.viscosity", fault, "use 'none', or solver = 'chebyshev'"
    if scene.fluid.rheology:
        yield "fluid.rheology", "'iisph' has artificial viscosity alone", other
    if numerics.turbulence != "none":
        yield "numerics.turbulence", "'iisph' has no turbulence model", other
    if numerics.velocity_reconstruction != "none":
        yield "numerics.velocity_reconstruction", "'iisph' has all of the artificial viscosity", other
    if numerics.shifting:
        yield "numerics.shifting", "'iisph' shifts no particles", other
    if (numerics.density_relaxation or 0.0) > 1.0:
        fault = "a step of 'iisph' takes away a share of the error of the density, at most all of it"
        yield "numerics.density_relaxation", fault, "use 1 for the source's scheme, or remove it"
    if scene.closed:
        yield (
            key,
            "'iisph' needs a free surface, where the pressure is zero",
            "lower fluid.still_water_level, or use 'converged'",
        )


def _of_others(scene: Scene) -> Iterator[Fault]:
    numerics = scene.numerics
    if scene.tank.boundary == "single_layer":
        fault = "boundary particles that count by weights are for solver = 'iisph'"
        yield "tank.boundary", fault, "use 'layers', or solver = 'iisph'"
    if numerics.kernel != "wendland":
        yield "numerics.kernel", f"{numerics.kernel!r} is for solver = 'iisph'", "use 'wendland'"
    if numerics.smoothing_ratio < NARROWEST:
        fault = f"{numerics.smoothing_ratio:g} is for solver = 'iisph'"
        yield "numerics.smoothing_ratio", fault, f"use {NARROWEST:g} or more"
