"""The fluid that a scene's solver steps."""

from __future__ import annotations

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import Layout
from fsi.scene.model import Scene


def make_fluid(scene: Scene, layout: Layout, team: Team, **parts) -> Fluid:
    """A `Fluid` with these `parts`, or where the scene asks for it one of another kind."""
    if scene.numerics.solver == "iisph":
        from fsi.fluid.implicit import ImplicitFluid

        return ImplicitFluid(scene, layout, team, **parts)
    return Fluid(scene, layout, team, **parts)
