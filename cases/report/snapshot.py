"""Particles of a run at a few times, drawn from the side, with the bodies where they are."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cases.report import charts
from cases.report.terrain import bed
from fsi.errors import SceneError
from fsi.record.colours import colour_map
from fsi.record.fields import CATEGORIES, top
from fsi.record.timeline_reader import read_snapshots
from fsi.scene.fields import field_of
from fsi.scene.model import Scene

SLICE = 1.5  # half the thickness in spacings of the slice that is drawn of a three-dimensional run
WIDE = 3.0  # length over height of a tank, above which its panels stand one over the other
BODY, GROUND = "#9aa0a6", "#c9b79c"
ARROW = 0.25  # length of an arrow over the height of the tank


def snapshot_figure(recording: Path, times: Iterable[float], data, scene: Scene, arrows=()):
    """A figure with one panel for each snapshot nearest to these times [s], and its caption. `arrows` are forces, each from a
    place (3,) [m] in a direction (3,). Raises SceneError where the recording has none."""
    shots = read_snapshots(recording, list(times))
    if not shots:
        raise SceneError("the timeline has no particles", fix="run the scene with output.particles above 0")
    length, height = (scene.tank.max[i] - scene.tank.min[i] for i in (0, -1))
    columns = 1 if length > WIDE * height else 2
    rows = math.ceil(len(shots) / columns)
    wide = charts.WIDTH / columns
    figure, panels = charts.canvas(rows, columns, height=min(0.86 * wide * height / length + 0.75, 6.0))
    visuals, field = visuals_of(scene), scene.output.fields[0]
    ground = made[0] if scene.dimension == 2 and (made := bed(scene)) else None
    for panel, shot in zip(panels, shots, strict=False):
        _panel(panel, shot, scene, visuals, data, ground)
        for place, direction in arrows:
            _arrow(panel, place, direction, ARROW * (scene.tank.max[-1] - scene.tank.min[-1]))
    for panel in panels[len(shots) :]:
        panel.remove()
    _legend(figure, panels[: len(shots)], scene, field)
    where = "" if scene.dimension == 2 else ", in a slice along the middle of the tank"
    return figure, f"Particles coloured by {field.replace('_', ' ')}{where}; bodies in grey"


def _panel(panel, shot, scene: Scene, visuals, data, ground) -> None:
    from matplotlib.collections import EllipseCollection, PolyCollection

    position, level = shot.position, shot.level
    if scene.dimension == 3:
        middle = 0.5 * (scene.tank.min[1] + scene.tank.max[1])
        chosen = np.abs(position[:, 1] - middle) < SLICE * scene.spacing
        position, level = position[chosen], level[chosen]
    colours = np.concatenate([colour_map(), CATEGORIES])[level] / 255
    size = np.full(len(position), 2 * shot.radius)
    dots = EllipseCollection(
        size, size, np.zeros(len(size)), units="xy", offsets=position[:, [0, 2]], facecolors=colours, linewidths=0,
        transOffset=panel.transData,
    )  # fmt: skip
    panel.add_collection(dots)
    if ground is not None:
        panel.fill_between(ground[:, 0], ground[:, 2], scene.tank.min[-1], color=GROUND, linewidth=0)
    for corners in _bodies_at(shot.time, visuals, data):
        panel.add_collection(PolyCollection(corners, facecolors=BODY, edgecolors=BODY, linewidths=0.3))
    panel.set(
        xlim=(scene.tank.min[0], scene.tank.max[0]),
        ylim=(scene.tank.min[-1], scene.tank.max[-1]),
        aspect="equal",
        xlabel="x [m]",
        ylabel="z [m]",
    )
    panel.set_title(f"t = {shot.time:.3f} s", loc="left", fontsize=13)
    panel.grid(visible=False)


def _arrow(panel, place: np.ndarray, direction: np.ndarray, length: float) -> None:
    """An arrow of this length [m] in the plane of the panel."""
    flat = np.array([direction[0], direction[2]])
    size = float(np.linalg.norm(flat))
    if size > 0:
        start = np.array([place[0], place[2]])
        style = {"arrowstyle": "-|>", "color": "#c2185b", "linewidth": 2.5, "mutation_scale": 18}
        panel.annotate("", xy=start + length * flat / size, xytext=start, arrowprops=style, zorder=6)


def _legend(figure, panels, scene: Scene, field: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.patches import Patch

    facts = field_of(field)
    if facts.names:
        patches = [
            Patch(color=CATEGORIES[n % len(CATEGORIES)] / 255, label=name) for n, name in enumerate(facts.names(scene))
        ]
        panels[0].legend(handles=patches, loc="upper right", fontsize=11)
        return
    colours = ScalarMappable(Normalize(0, top(scene, field)), ListedColormap(colour_map() / 255))
    label = f"{field.replace('_', ' ')} [{facts.units}]"
    rows = panels[0].get_subplotspec().get_gridspec().nrows
    figure.colorbar(colours, ax=panels, label=label, shrink=min(0.9, 1.6 / rows), aspect=20, pad=0.02)


def visuals_of(scene: Scene) -> list:
    """Meshes of the scene's bodies; none where they cannot be loaded any more."""
    if not scene.bodies:
        return []
    from bodies import load

    try:
        return load(scene).visuals()
    except SceneError:
        return []


def _bodies_at(time: float, visuals, data) -> Iterable[np.ndarray]:
    """Triangles (m, 3, 2) of every mesh in x and z at a time, where the log has the pose of its body."""
    for visual in visuals:
        pose = pose_at(visual.body, time, data)
        if pose is not None:
            position, rotation = pose
            world = visual.vertices @ rotation.T + position
            yield world[visual.triangles][:, :, [0, 2]]


def pose_at(body: str, time: float, data):
    if not body:
        return np.zeros(3), np.eye(3)
    for dim, prefix in (("body", "body"), ("dry_body", "dry")):
        if dim in data.dims and body in data[dim].values:
            here = (
                data[[f"{prefix}_position", f"{prefix}_quaternion"]].sel({dim: body}).sel(time=time, method="nearest")
            )
            return here[f"{prefix}_position"].values, _rotation(here[f"{prefix}_quaternion"].values)
    return None


def _rotation(q: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
