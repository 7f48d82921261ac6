"""The volume of a sea without bodies, held by integral action.

Waves stir the particles, which then take more room, and the relaxation of the density, in proportion to what is too much,
leaves a part of that for good: the level of a sea rises. `draw` is the sum of what was too much, step by step, and acts in the
pressure equation beside the density's own error, until the volume is that of the start.
"""

from __future__ import annotations

import numpy as np

from fsi.compute.reduce import Reductions
from fsi.scene.model import Scene

COUNTED = 2.0**40  # parts of a particle's volume in which they are counted, so that the sum does not depend on any order


def held(scene: Scene) -> bool:
    """Whether the volume of a scene is held: splashes around bodies would count as it, and the implicit solver has no draw."""
    return scene.sea is not None and not scene.bodies and scene.numerics.solver != "iisph"


class Volume:
    """draw: what acts in the next step, as a share of the density; start: mean volume of a particle at the start over dr^dim,
    None before the first step."""

    def __init__(self, reductions: Reductions):
        self._reductions, self.draw, self.start = reductions, 0.0, None

    def update(self, deficit: np.ndarray, gain: float) -> None:
        """Take in a step: deficit (n,) of the density of the particles of this process, gain the share of their mean that is
        drawn together."""
        room = np.rint(COUNTED * (1.0 / (1.0 - deficit.astype(float)) - 1.0)).astype(np.int64)
        mean = int(self._reductions.combined(int(room.sum()))) / int(self._reductions.combined(len(room))) / COUNTED
        self.start = mean if self.start is None else self.start
        self.draw += gain * (mean - self.start)

    def state(self) -> dict:
        """All that it remembers."""
        return {"draw": self.draw, "start": self.start}

    def restore(self, state: dict) -> None:
        """Go on from `state`."""
        self.draw, self.start = float(state["draw"]), None if state["start"] is None else float(state["start"])
