"""What can be wrong with bodies in a tank: each fault is a SceneError that names the place and the way out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from bodies.mjcf import GEOM, name_of
from bodies.shapes.primitives import Box, Cylinder, Placed
from bodies.sizes import units
from fsi.errors import SceneError
from fsi.owners import FIRST_BODY, WALL
from fsi.particles.displaced import cells
from fsi.scene.model import Scene

DEEP = 0.1  # spacings that two geoms may stand in each other at the start
ACROSS = 4  # particles across the largest extent of a body, at least
THICK = 6  # spacings, from which on Archimedes holds to 3 % whatever the thickness
OFF, CELLS = 0.04, 20_000  # of the volume that particles may be off; cells to find it by

Owned = Sequence[tuple[int, Placed]]


def check_mass(names: Sequence[str], mass: np.ndarray, source: object) -> None:
    """Every wet body needs mass [kg] of its own."""
    for name, value in zip(names, mass, strict=True):
        if value <= 0.0:
            fix = "give its geoms mass or density, or move them to the body that carries them"
            raise SceneError(f"wet body {name!r} has no mass", key="bodies", file=source, fix=fix)


def check_driven(model: mujoco.MjModel, geoms: Sequence[int], source: object) -> None:
    """Raise SceneError for a wet geom of a mocap body: it has no joint, so that the fluid takes it for a fixed wall, and is
    moved from outside all the same."""
    for geom in geoms:
        if model.body_mocapid[model.body_rootid[model.geom_bodyid[geom]]] >= 0:
            fault = "belongs to a mocap body, which moves without a joint; the fluid would take it for a fixed wall"
            fix = "give its body a joint and use coupler.scheme = 'prescribed', or weld a body with a joint to the mocap body"
            raise SceneError(fault, key=f"geom {name_of(model, GEOM, geom)!r}", file=source, fix=fix)


def check_contacts(model: mujoco.MjModel, data: mujoco.MjData, spacing: float, source: object) -> None:
    """Raise SceneError for geoms that stand in each other at the start, where MuJoCo would shoot them apart."""
    mujoco.mj_fwdPosition(model, data)
    for contact in data.contact[: data.ncon]:
        depth = contact.includemargin - contact.dist
        if depth > DEEP * spacing:
            first, second = (name_of(model, GEOM, geom) for geom in contact.geom)
            fix = "move them apart, or switch their contact off (contype, conaffinity, exclude)"
            apart = (
                f"the {contact.includemargin:.3g} m that they have to keep" if contact.includemargin else "each other"
            )
            fault = f"geoms {first!r} and {second!r} stand {depth:.3g} m in {apart} at the start"
            raise SceneError(fault, key="bodies", file=source, fix=fix)


def check_solids(
    solids: Owned,
    labels: Sequence[str],
    names: Sequence[str],
    rotation: np.ndarray,
    spacing: float,
    layers: int,
    source,
) -> list[str]:
    """Overlap, thickness and resolution of the solids in their initial pose: labels (solids,) name their geoms,
    names (b,) the bodies, rotation (b, 3, 3) turns from body to world.

    Returns notes. Raises SceneError where bodies overlap or one is resolved by too few particles.
    """
    notes = []
    clouds = [solid.boundary(spacing, layers) for _, solid in solids]
    for label, (_, solid), cloud in zip(labels, solids, clouds, strict=True):
        notes += _thin(label, solid, spacing)
        dropped = len(solid.sampled(spacing, layers)) - len(cloud)
        if dropped:
            notes.append(
                f"geom {label!r} overlaps others of its body: {dropped} boundary particles inside them left out"
            )
    for i, (owner, solid) in enumerate(solids):
        for j, (other, _) in enumerate(solids):
            if owner != other and (solid.clearance(clouds[j]) < 0.0).any():
                first, second = f"{labels[j]!r} ({_owner(other, names)})", f"{labels[i]!r} ({_owner(owner, names)})"
                fix = "move them apart, or make them geoms of one body"
                raise SceneError(f"geom {first} overlaps geom {second}", key="bodies", file=source, fix=fix)
    for b, name in enumerate(names):
        points = np.vstack([cloud for (owner, _), cloud in zip(solids, clouds, strict=True) if owner == FIRST_BODY + b])
        _check_resolution(name, points, rotation[b], spacing, source)
    return notes


def check_inside(
    solids: Owned, labels: Sequence[str], names: Sequence[str], scene: Scene, source: object, looks: Mapping[str, str]
) -> list[str]:
    """Raise SceneError for a body that reaches beyond the tank, to a hundredth of the spacing, and where no fixed solid
    meets it; notes on the other fixed ones that do not. It looks at bounds alone, before anything is sampled. looks:
    name -> note of geoms that are there to be seen."""
    tank, slack = scene.tank, 0.01 * scene.spacing
    low, high = np.array(tank.min), np.array(tank.max)
    apart, met = {}, False
    for label, (owner, solid) in zip(labels, solids, strict=True):
        least, most = solid.bounds()
        if owner == WALL:
            margin = scene.layers * scene.spacing
            beside = np.flatnonzero((least > high + margin) | (most < low - margin))
            met = met or not beside.size
            for k in beside[:1]:
                where = f"{tank.axes[k]} = {least[k]:.4g} to {most[k]:.4g} m"
                apart[label] = f"lies outside the tank: {where} where the tank has {low[k]:g} to {high[k]:g} m"
            continue
        for k, axis in enumerate(tank.axes):
            if least[k] < low[k] - slack or most[k] > high[k] + slack:
                end, wall = (least[k], low[k]) if least[k] < low[k] - slack else (most[k], high[k])
                name = names[owner - FIRST_BODY]
                fault = f"body {name!r} reaches {axis} = {end:.4g} m, beyond the tank's {axis} = {wall:.4g} m"
                fix = "move it with bodies.NAME.position, or enlarge the tank"
                fix += f"; {looks[label]}" if label in looks else ""
                fix = units(label, float((most - least).max()), scene) or fix
                raise SceneError(fault, key="bodies", file=source, fix=fix)
    if apart and not met:
        label, fault = next(iter(apart.items()))
        raise SceneError(fault, key=f"geom {label!r}", file=source, fix="move it with bodies.NAME.position")
    return [f"geom {label!r} {fault}, and has no effect" for label, fault in apart.items()]


def _thin(label: str, solid: Placed, spacing: float) -> list[str]:
    thickness = solid.shape.thickness(spacing)
    if thickness > 2 * spacing * (1 - 1e-6):
        return []
    return [
        f"geom {label!r} is {thickness:.3g} m thick, under two spacings ({2 * spacing:g} m): fluid on its two sides "
        f"meets through it; a spacing of {thickness / 2:.2g} m resolves it"
    ]


def lift(solids: Owned, labels: Sequence[str], scene: Scene) -> list[str]:
    """Notes on moving boxes and cylinders whose boundary particles stand for another volume than theirs: each
    stands for spacing**dim, which is what the fluid lifts where its kernel reaches through. From `THICK` spacings on the
    surface alone counts."""
    if scene.numerics.standing_pressure == "apart" or scene.single_layer or not scene.gravity:
        return []
    notes, dr = [], scene.spacing
    for label, (owner, solid) in zip(labels, solids, strict=True):
        thickness = solid.shape.thickness(dr)
        if owner < FIRST_BODY or not isinstance(solid.shape, Box | Cylinder) or thickness > THICK * dr:
            continue
        volume = float(cells([solid], CELLS)[1].sum())
        share = len(solid.sampled(dr, scene.layers)) * dr**scene.dimension / volume
        if abs(share - 1) > OFF:
            whole = max(2, round(thickness / dr))
            finer = thickness / (whole if whole * dr > thickness * (1 + 1e-6) else whole + 1)
            exact = "" if scene.liquids else 'numerics.standing_pressure = "apart" makes it exact, '
            thin = f"geom {label!r} is {thickness / dr:.3g} spacings thick: particles stand for {100 * share:.0f} % of it"
            fix = f"{exact}a spacing of {finer:.3g} m better"
            notes.append(f"{thin}, and about so much of its buoyancy acts where it is all under water; {fix}")
    return notes


def _check_resolution(name: str, points: np.ndarray, rotation: np.ndarray, spacing: float, source: object) -> None:
    axes = rotation[np.ix_([0, 2], [0, 2])] if points.shape[1] == 2 else rotation
    local = points @ axes
    extent = float(np.ptp(local, axis=0).max()) + spacing
    if extent < (ACROSS - 1e-6) * spacing:
        fault = f"body {name!r} is {extent / spacing:.1f} particles across at its largest"
        fix = f"set spacing to {extent / ACROSS:.2g} m or less"
        raise SceneError(fault, key="spacing", file=source, fix=fix)


def _owner(owner: int, names: Sequence[str]) -> str:
    return "fixed wall" if owner == WALL else f"body {names[owner - FIRST_BODY]!r}"
