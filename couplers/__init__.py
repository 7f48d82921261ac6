"""How the fluid and the bodies exchange force and motion within a step: one module a scheme, with its settings.

A scene names the scheme by `coupler.scheme`, the name of its entry point (`fsi.scene.coupler`)."""

from couplers.added_mass import AddedMass
from couplers.fixed_point import FixedPoint
from couplers.lagged import Lagged
from couplers.prescribed import Prescribed
from fsi.protocols import BodySet, Coupler
from fsi.scene.coupler import CouplerSettings

__all__ = ["AddedMass", "FixedPoint", "Lagged", "Prescribed", "make"]


def make(settings: CouplerSettings, bodies: BodySet, source: object = "scene.toml") -> Coupler:
    """The coupler of a scene. Raises SceneError, which calls the scene `source`, for joints that do not exist."""
    return settings.make(bodies, source)
