"""How fluid and bodies exchange force and motion: the settings that every coupling scheme has.

A scheme is a subclass of `CouplerSettings` in a module of its own, with the coupler that it makes (`couplers.lagged` is the
shortest), registered as an entry point of the group `spindrift.couplers` (`fsi.plugins`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from fsi import plugins
from fsi.parts import Part, Positive
from fsi.scene.kinds import ChosenBy

if TYPE_CHECKING:
    from fsi.protocols import BodySet, Coupler


class CouplerSettings(Part):
    """The scheme and what all schemes share. A scheme of its own sets `scheme: Literal["NAME"] = "NAME"`, adds its keys and
    says what it makes."""

    scheme: str = "added_mass"  # docs/guide/coupling.md
    tolerance: Positive = 1e-6  # of the settled acceleration, relative

    def make(self, bodies: BodySet, source: object = "scene.toml") -> Coupler:
        """The coupler of these bodies. Raises SceneError, which calls the scene `source`, for what they do not have."""
        return _load(self.scheme).model_validate(self.model_dump()).make(bodies, source)

    def faults(self, scene) -> Iterator[tuple[str, str, str]]:
        """Key, fault and fix of what cannot work in this scene."""
        return iter(())


def _names():
    return plugins.registered("couplers")


def _load(name: str) -> type[CouplerSettings]:
    return plugins.find("couplers", name)


AnyCoupler = Annotated[CouplerSettings, ChosenBy("scheme", "added_mass", _names, _load)]
