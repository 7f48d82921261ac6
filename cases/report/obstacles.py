"""What stands in the way of the waves of a flume: fixed geoms and bathymetry, seen from the piston."""

from __future__ import annotations

import json
import math
from functools import lru_cache

import numpy as np

from fsi.errors import SceneError
from fsi.scene.geometry import wave_depth
from fsi.scene.model import Scene

FLAT = 0.05  # of the depth, by which the floor may rise


def obstacles(scene: Scene) -> tuple[float, float]:
    """The first place [m] along x where the water is not as deep as at the piston, and the first where a fixed solid stands in
    the still surface, both in the middle of the tank; inf where there is none, or where the scene's files cannot be read any
    more."""
    if not scene.waves or not (scene.bodies or scene.tank.bathymetry):
        return math.inf, math.inf
    return _found(scene.model_dump_json())


@lru_cache(maxsize=8)
def _found(text: str) -> tuple[float, float]:
    from fsi.owners import FIRST_BODY
    from fsi.scene.binding import bind
    from fsi.trust import checking

    scene = Scene.model_validate(json.loads(text))
    try:
        with checking():
            bodies, _, ground = bind(scene, scene.name)
    except SceneError:
        return math.inf, math.inf
    fixed = [solid for owner, solid in (bodies.solids() if bodies else ()) if owner < FIRST_BODY]
    fixed += [ground] if ground else []
    if not fixed:
        return math.inf, math.inf
    dr, depth, level = scene.spacing, wave_depth(scene), scene.fluid.still_water_level
    x = np.arange(scene.tank.min[0] + dr / 2, scene.tank.max[0], dr)
    z = np.arange(level - (1 - FLAT) * depth, level, dr)
    points = np.stack([np.repeat(x, len(z)), np.tile(z, len(x))], axis=1)
    if scene.dimension == 3:
        middle = (scene.tank.min[1] + scene.tank.max[1]) / 2
        points = np.insert(points, 1, middle, axis=1)
    solid = np.min([one.clearance(points) for one in fixed], axis=0).reshape(len(x), len(z)) < 0.0
    uneven, dry = solid.any(axis=1), solid[:, -1]
    return tuple(float(x[np.argmax(where)]) if where.any() else math.inf for where in (uneven, dry))  # type: ignore[return-value]
