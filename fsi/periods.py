"""Natural periods of floating bodies."""

from __future__ import annotations

import math

import numpy as np

from fsi.errors import SceneError
from fsi.particles.potential import added_mass
from fsi.plugins import find
from fsi.scene.binding import bind
from fsi.scene.model import Scene
from fsi.trust import checking

LONGEST = 100.0  # s; beyond it nothing brings a body back


def natural_periods(scene: Scene, label: str) -> dict[str, float]:
    """Undamped natural periods [s] of the bodies about their rest in still water, by the motion that each is mostly made of:
    T = 2 pi sqrt((M + Ma) / C), with the added mass Ma of infinite frequency and the stiffness C of buoyancy, springs and
    mooring lines. Raises SceneError where there is no such rest."""
    if not scene.bodies:
        return {}
    still = scene.model_copy(
        update={
            "waves": None,
            "control": None,
            "coupler": find("couplers", "added_mass")(),
            "bodies": {name: body.model_copy(update={"start": "equilibrium"}) for name, body in scene.bodies.items()},
        }
    )
    if scene.fluid.blocks or scene.liquids or not scene.gravity:
        fault = "natural periods are of bodies in one liquid up to the still water level"
        raise SceneError(fault, key="--periods", file=label, fix="leave it out")
    with checking():
        bodies, _, ground = bind(still, label)
    stiffness, motions = bodies.restoring()
    moving = np.array([bool(name) for name in motions])
    inertia = bodies.inertia() + added_mass(still, bodies.solids(), ground, bodies.motion())
    inertia = inertia[np.ix_(moving, moving)]
    values, shapes = np.linalg.eig(np.linalg.solve(inertia, stiffness[np.ix_(moving, moving)]))
    names, found = [name for name in motions if name], {}
    for value, shape in sorted(zip(values.real, shapes.real.T, strict=True), key=lambda pair: -pair[0]):
        if value > (2 * math.pi / LONGEST) ** 2:
            mostly = names[int(np.argmax(np.abs(shape) * np.sqrt(np.diag(inertia))))]
            found.setdefault(mostly, 2 * math.pi / math.sqrt(value))
    return found
