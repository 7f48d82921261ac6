"""`fsi render DIR`: pictures and a video of a run, also on a machine without a screen."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np

from cases.pictures.frames import Frame, RunFrames
from cases.pictures.look import Look, caption, limits, values_of
from fsi.errors import SceneError
from fsi.extras import require
from fsi.record.colours import colour_map

BODY = "#9aa0a6"
FPS = {"mp4": 25, "gif": 12}
WIDE, LEAST = 1280, 240  # pixels of a picture in two dimensions, across and at least down
BESIDE, ABOVE = 150, 90  # pixels that axes, title and colours take


def render(
    folder: str | Path, to: str = "mp4", *, look: Look | None = None, every: int = 1, start: float = 0.0,
    until: float | None = None, fps: int | None = None,
) -> Path:  # fmt: skip
    """Draw every so many-th frame between `start` and `until` [s] and return what was written: the folder `pictures` of the run
    with `frame_0000.png`, ..., or `run.mp4` or `run.gif`. Raises SceneError where there is nothing to draw."""
    look, run = look or Look(), RunFrames(folder)
    _check(run, look)
    frames = (f for f in run if f.time >= start - 1e-9 and (until is None or f.time <= until + 1e-9))
    pictures = _pictures(run, look, islice(frames, 0, None, every))
    imageio = require("imageio.v3", "render", "pictures of a run")
    if to == "png":
        target = run.folder / "pictures"
        target.mkdir(exist_ok=True)
        for number, picture in enumerate(_some(pictures)):
            imageio.imwrite(target / f"frame_{number:04}.png", picture)
        return target
    target, rate = run.folder / f"run.{to}", fps or FPS[to]
    if to == "gif":
        imageio.imwrite(target, list(_some(pictures)), duration=1000 / rate, loop=0)
        return target
    pictures = _some(pictures)
    first = next(pictures)  # before the file is there
    with require("imageio", "render", "a video of a run").get_writer(target, fps=rate, macro_block_size=2) as writer:
        for picture in chain([first], pictures):
            writer.append_data(picture)
    return target


def _some(pictures: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """The pictures. Raises SceneError where there are none."""
    none = True
    for picture in pictures:
        none = False
        yield picture
    if none:
        raise SceneError("no frame lies between these times", key="--from", fix="give other times")


def _check(run: RunFrames, look: Look) -> None:
    scene = run.scene
    known = {*scene.output.fields, "pressure", "speed"} if run.exact else {scene.output.fields[0]}
    if look.field and look.field not in known:
        fix = f"known are {', '.join(sorted(known))}"
        if not run.exact:
            fix += "; a run with output.values = true keeps all of output.fields, pressure and speed"
        raise SceneError(f"the timeline has no values of {look.field!r}", key="--field", fix=fix)
    if look.surface:
        run.check_whole()
    if look.camera and scene.dimension == 2:
        raise SceneError("a two-dimensional run is seen from the side", key="--camera", fix="use --window")
    if look.window and scene.dimension == 3:
        raise SceneError("a three-dimensional run has a camera", key="--window", fix="use --camera")


def _pictures(run: RunFrames, look: Look, frames: Iterator[Frame]) -> Iterator[np.ndarray]:
    """RGB pictures (height, width, 3) uint8."""
    if run.scene.dimension == 2:
        return _flat(run, look, frames)
    from cases.pictures.render3d import pictures

    return pictures(run, look, frames)


def _flat(run: RunFrames, look: Look, frames: Iterator[Frame]) -> Iterator[np.ndarray]:
    require("matplotlib", "report", "pictures of a run")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.figure import Figure

    scene, field = run.scene, look.field or run.scene.output.fields[0]
    left, right, low, high = look.window or (scene.tank.min[0], scene.tank.max[0], scene.tank.min[1], scene.tank.max[1])
    colours = ScalarMappable(Normalize(*limits(run, look, field)), ListedColormap(colour_map() / 255))
    walls, (wide, tall) = run.walls(), look.size or (WIDE, _height((right - left) / (high - low)))
    for frame in frames:
        figure = Figure(figsize=(wide / 100, tall / 100), dpi=100, layout="compressed")
        canvas, panel = FigureCanvasAgg(figure), figure.add_subplot()
        _draw(panel, run, look, frame, field, colours)
        for _, wall in walls:
            panel.plot(*wall.vertices[:, [0, 2]].T, color="#404040", linewidth=2.5)
        panel.set(xlim=(left, right), ylim=(low, high), aspect="equal", xlabel="x [m]", ylabel="z [m]")
        panel.set_title(f"{scene.name}, t = {frame.time:.2f} s", loc="left")
        if not look.surface:
            figure.colorbar(colours, ax=panel, label=caption(field), aspect=25, pad=0.01)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _height(shape: float) -> int:
    """Height [pixels] of a picture `WIDE` pixels wide of a window `shape` times as wide as high."""
    return 2 * round(min(max((WIDE - BESIDE) / shape + ABOVE, LEAST), WIDE) / 2)


def _draw(panel, run: RunFrames, look: Look, frame: Frame, field: str, colours) -> None:
    from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

    if look.surface:
        from cases.pictures.surface import surface

        mesh = surface(frame.position, run.scene.spacing, 2)
        lines = mesh.vertices[:, [0, 2]]
        panel.add_collection(PolyCollection(_loops(lines, mesh.cells), facecolors="#9cc4e4", edgecolors="none"))
        panel.add_collection(LineCollection(lines[mesh.cells], colors="#1f5f95", linewidths=1.2))
    else:
        size = np.full(len(frame.position), run.scene.spacing / np.sqrt(run.share))
        panel.add_collection(
            EllipseCollection(
                size, size, np.zeros(len(size)), units="xy", offsets=frame.position[:, [0, 2]], linewidths=0,
                facecolors=colours.to_rgba(values_of(frame, field)), transOffset=panel.transData,
            )
        )  # fmt: skip
    for _, mesh in run.bodies(frame.time):
        corners = mesh.vertices[mesh.cells][:, :, [0, 2]]
        panel.add_collection(PolyCollection(corners, facecolors=BODY, edgecolors=BODY, linewidths=0.3))


def _loops(points: np.ndarray, cells: np.ndarray) -> list[np.ndarray]:
    """The lines that follow each other, as polygons."""
    if not len(cells):
        return []
    breaks = np.flatnonzero(cells[1:, 0] != cells[:-1, 1]) + 1
    return [points[np.append(part[:, 0], part[-1, 1])] for part in np.split(cells, breaks)]
