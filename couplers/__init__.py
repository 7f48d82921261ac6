"""How the fluid and the bodies exchange force and motion within a step: one module a scheme."""

from couplers.added_mass import AddedMass
from couplers.fixed_point import FixedPoint
from couplers.lagged import Lagged
from couplers.prescribed import Prescribed
from fsi.errors import SceneError
from fsi.protocols import BodySet, Coupler
from fsi.scene.model import CouplerSettings

__all__ = ["AddedMass", "FixedPoint", "Lagged", "Prescribed", "make"]


def make(settings: CouplerSettings, bodies: BodySet, source: object = "scene.toml") -> Coupler:
    """The coupler of a scene. Raises SceneError, which calls the scene `source`, for joints that do not exist."""
    if settings.scheme == "prescribed":
        return Prescribed(settings.motion, bodies, source)
    if settings.motion:
        fix = 'set coupler.scheme = "prescribed" or remove it'
        raise SceneError("has no effect with this scheme", key="coupler.motion", file=source, fix=fix)
    if settings.scheme == "fixed_point":
        return FixedPoint(bodies, settings.tolerance)
    return Lagged(bodies) if settings.scheme == "lagged" else AddedMass(bodies)
