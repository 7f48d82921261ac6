"""Checks of the liquids of a scene and of their blocks against each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsi.scene.geometry import all_blocks
from fsi.scene.model import Block, Scene
from fsi.scene.region import contains, shaped
from fsi.waves.kind import Fault

SAMPLES = 64  # places along each axis, at which two shapes are compared
GAS = 100.0  # density ratio up to which everything is stable
GAS_MACH = 0.1  # numerics.mach beyond it; measured


def liquid_faults(scene: Scene) -> Iterator[Fault]:
    """Liquids without a place, blocks outside the tank, blocks that overlap."""
    tank, blocks = scene.tank, all_blocks(scene)
    for name, liquid in scene.liquids.items():
        if not liquid.blocks:
            yield f"liquids.{name}", "is nowhere", f"add [[liquids.{name}.blocks]] with min and max"
    for key, block in blocks.items():
        low, high = np.subtract(block.min, tank.min), np.subtract(tank.max, block.max)
        if min(*low, *high) < -1e-9:
            span, room = (f"{list(box.min)} to {list(box.max)} m" for box in (block, tank))
            yield key, f"{span} leaves the tank {room}", "shrink or move it"
    for one, two in _overlaps(blocks):
        if one.startswith("fluid.") == two.startswith("fluid."):  # another liquid takes the fluid's place
            yield two, f"overlaps {one}", "let blocks touch but not overlap"


def _overlaps(blocks: dict[str, Block]) -> Iterator[tuple[str, str]]:
    """Keys of the blocks that overlap, in their order."""
    keys = list(blocks)
    low, high = (np.array([getattr(block, end) for block in blocks.values()]) for end in ("min", "max"))
    for n, key in enumerate(keys):
        shared = (np.maximum(low[n], low[n + 1 :]) + 1e-9 < np.minimum(high[n], high[n + 1 :])).all(-1)
        others = (keys[n + 1 + other] for other in np.flatnonzero(shared))
        yield from ((key, other) for other in others if _share(blocks[key], blocks[other]))


def _share(one: Block, two: Block) -> bool:
    """Whether two blocks whose boxes overlap have more in common than a touch."""
    if not (shaped(one) or shaped(two)):
        return True
    low, high = np.maximum(one.min, two.min), np.minimum(one.max, two.max)
    count = SAMPLES if len(low) == 2 else SAMPLES // 4
    places = low + (high - low) * (np.indices((count,) * len(low)).reshape(len(low), -1).T + 0.5) / count
    return (contains(one, places, 0.0) & contains(two, places, 0.0)).sum() > count // 8


def liquid_warnings(scene: Scene) -> list[str]:
    """What is allowed but likely not meant, one line each."""
    density = [liquid.density for liquid in scene.all_liquids]
    ratio, numerics = max(density) / min(density), scene.numerics
    if ratio <= GAS:
        return []
    warnings = []
    if numerics.mach > GAS_MACH:
        warnings.append(f"numerics.mach: {numerics.mach:g} with a density ratio of {ratio:.3g}; use {GAS_MACH} or less")
    if numerics.solver == "converged":
        warnings.append(f"numerics.solver: 'converged' is unstable at a density ratio of {ratio:.3g}; use 'chebyshev'")
    if scene.closed:
        warnings.append(
            f"fluid.still_water_level: a full tank is unstable at a density ratio of {ratio:.3g}; leave room under its lid"
        )
    return warnings
