"""How particles are drawn: the values and colours of their fields (`fsi.scene.fields`), which of them, and where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsi.protocols import Frame
from fsi.scene.fields import field_of
from fsi.scene.geometry import fluid_depth
from fsi.scene.model import Scene

VALUE = "value_"  # before the names of what `output.values` keeps
CATEGORIES = np.array(  # colours of things without an order, told apart by lightness as well as by hue
    [[31, 119, 180], [240, 150, 40], [44, 130, 60], [190, 60, 60], [150, 110, 200], [120, 90, 70]], np.uint8
)


def values(frame: Frame, name: str) -> np.ndarray:
    """Values (n,) of a field in a frame with particles."""
    return field_of(name).values(frame)


def top(scene: Scene, name: str) -> float:
    """The highest value of a field's colours."""
    return field_of(name).top(scene, fluid_depth(scene))


def levels(frame: Frame, name: str, scene: Scene) -> np.ndarray:
    """Values (n,) uint8 of a field for its colours: 0 to 255 over the range, or the number of the category."""
    found = np.nan_to_num(values(frame, name))
    if field_of(name).names:
        return found.astype(np.uint8)
    return np.clip(found * (255 / top(scene, name)), 0, 255).astype(np.uint8)


def raster(scene: Scene) -> float:
    """Raster [m] that drawn positions are rounded to: a power of two, so that they compress, of at most an eighth of
    the spacing, which cannot be seen."""
    return float(2.0 ** np.floor(np.log2(scene.spacing / 8)))


def drawn(label: np.ndarray, share: float) -> np.ndarray:
    """Which particles (n,) bool are drawn: always the same ones, by a hash of their labels, so that none flickers and no
    pattern of the lattice shows; none without a label (images of particles across a periodic boundary)."""
    scattered = label.astype(np.uint32) * np.uint32(2654435761)
    scattered ^= scattered >> np.uint32(15)
    scattered *= np.uint32(2246822519)
    return (label >= 0) & ((scattered >> np.uint32(8)) < share * 2**24)


def thinned(frame: Frame, share: float) -> Frame:
    """The frame with the share of its particles that is drawn."""
    if share >= 1 and (frame.label >= 0).all():
        return frame
    chosen = drawn(frame.label, share)
    picked = {name: getattr(frame, name)[chosen] for name in ("position", "velocity", "pressure", "label")}
    return replace(frame, **picked, fields={name: f[chosen] for name, f in frame.fields.items()}, drawn=share)


def particle_values(frame: Frame, scene: Scene) -> dict[str, np.ndarray]:
    """What `output.values` keeps, flat and in single precision: positions and velocities (3 n,), pressures and fields (n,)."""
    flat = {"position": spatial(frame.position).ravel(), "velocity": spatial(frame.velocity).ravel()}
    found = {name: np.asarray(values(frame, name), np.float32) for name in ("pressure", *scene.output.fields)}
    return {f"{VALUE}{name}": array for name, array in (flat | found).items()}


def particle_bytes(scene: Scene) -> float:
    """Bytes that a drawn particle takes on the timeline, as measured: positions in the raster of `raster`, a byte
    and a half for each field."""
    whole = 4.0 * (6 + len({"pressure", *scene.output.fields})) if scene.output.values else 0.0
    return (5.1 if scene.dimension == 2 else 7.5) + 1.5 * len(scene.output.fields) + whole


def fraction(scene: Scene, count: int) -> float:
    """Share of `count` particles that is drawn: the scene's own, or what keeps the particles of the whole run within
    `output.particles_limit`."""
    output = scene.output
    if output.fraction is not None:
        return output.fraction
    if not output.particles or not count:
        return 1.0
    frames = 1 + scene.duration / output.particles
    return min(1.0, 1e6 * output.particles_limit / (frames * count * particle_bytes(scene)))


def spatial(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) or (n, 3) as (n, 3) float32, with y = 0 where there is none."""
    if points.shape[1] == 3:
        return points.astype(np.float32)
    out = np.zeros((len(points), 3), np.float32)
    out[:, ::2] = points
    return out
