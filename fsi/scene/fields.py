"""The fields that particles can be drawn with: one table, which the scene's check, the timeline, the log and the report
follow. A package adds one as an entry point of the group `spindrift.fields` (`fsi.plugins`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fsi import plugins
from fsi.protocols import Frame

Scene = Any  # fsi.scene.model.Scene, which imports this table


@dataclass(frozen=True)
class ParticleField:
    """A field. `values` gives those (n,) of a frame's particles; `top` the highest value of its colours for a scene whose
    fluid is so deep [m], the lowest is 0. One with `names` has a category for each of them in place of a range. `present`:
    whether the particles of a scene have it."""

    units: str
    values: Callable[[Frame], np.ndarray]
    top: Callable[[Scene, float], float] = lambda scene, depth: 1.0
    names: Callable[[Scene], list[str]] | None = None
    present: Callable[[Scene], bool] = lambda scene: True


def _wave_speed(scene: Scene, depth: float) -> float:
    """Of long waves, sqrt(g depth) [m/s]."""
    return (depth * (scene.gravity or 1.0)) ** 0.5


def _largest_viscosity(liquid) -> float:
    return liquid.rheology.rest_viscosity if liquid.rheology else liquid.density * liquid.kinematic_viscosity


def _turbulent(scene: Scene) -> bool:
    return scene.numerics.turbulence != "none"


def _viscosity_varies(scene: Scene) -> bool:
    several = len(scene.all_liquids) > 1 or scene.fluid.rheology is not None
    return scene.numerics.viscosity != "none" and (_turbulent(scene) or several)


FIELDS = {
    "pressure": ParticleField(
        "Pa",
        values=lambda frame: frame.pressure,
        top=lambda scene, depth: scene.fluid.density * (scene.gravity or 1.0) * depth,
    ),
    "speed": ParticleField(
        "m/s",
        values=lambda frame: np.linalg.norm(frame.velocity, axis=1),
        top=lambda scene, depth: 0.5 * _wave_speed(scene, depth),
    ),
    "viscosity": ParticleField(
        "Pa s",
        values=lambda frame: frame.fields["viscosity"],
        top=lambda scene, depth: max(_largest_viscosity(liquid) for liquid in scene.all_liquids),
        present=_viscosity_varies,
    ),
    "eddy_viscosity": ParticleField(
        "m2/s",
        values=lambda frame: frame.fields["eddy_viscosity"],
        top=lambda scene, depth: (scene.numerics.smagorinsky * scene.spacing) ** 2 * _wave_speed(scene, depth) / depth,
        present=_turbulent,
    ),
    "liquid": ParticleField(
        "",
        values=lambda frame: frame.fields["liquid"],
        names=lambda scene: ["fluid", *scene.liquids],
        present=lambda scene: bool(scene.liquids),
    ),
}


def known_fields() -> list[str]:
    """Names of all fields, ours first."""
    return [*FIELDS, *(name for name in plugins.registered("fields") if name not in FIELDS)]


def field_of(name: str) -> ParticleField:
    """The field of that name. Raises SceneError where the package that brings it cannot be imported."""
    if name in FIELDS:
        plugins.check_ours("fields", name)
        return FIELDS[name]
    return plugins.find("fields", name)
