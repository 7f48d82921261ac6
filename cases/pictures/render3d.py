"""Pictures of a three-dimensional run, drawn off the screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from cases.pictures.frames import Frame, Mesh, RunFrames
from cases.pictures.look import Look, caption, limits, values_of
from fsi.extras import require
from fsi.record.colours import colour_map

SIZE = 1280, 720  # pixels


def pictures(run: RunFrames, look: Look, frames: Iterator[Frame]) -> Iterator[np.ndarray]:
    """RGB pictures (height, width, 3) uint8 of the frames."""
    pv = require("pyvista", "render", "pictures of a three-dimensional run")
    from matplotlib.colors import ListedColormap

    scene, field = run.scene, look.field or run.scene.output.fields[0]
    colours = ListedColormap(colour_map() / 255)
    with suppress(ImportError):  # without a screen VTK says which windows it tried before it draws in memory
        from vtkmodules.vtkCommonCore import vtkLogger

        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    plotter = pv.Plotter(off_screen=True, window_size=list(look.size or SIZE))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    low, high = np.array(scene.tank.min), np.array(scene.tank.max)
    plotter.add_mesh(
        pv.Box([x for pair in zip(low, high, strict=True) for x in pair]), style="wireframe", color="#606060"
    )
    for name, wall in run.walls():
        if name == "bathymetry":
            plotter.add_mesh(_poly(pv, wall), color=wall.colour, smooth_shading=False)
    place = look.camera or _eye(low, high)
    plotter.camera_position = [place[:3], place[3:], (0, 0, 1)]
    for frame in frames:
        if look.surface:
            from cases.pictures.surface import surface

            mesh = surface(frame.position, scene.spacing, 3)
            if len(mesh.cells):
                water = _poly(pv, mesh)
                plotter.add_mesh(
                    water, name="fluid", color=mesh.colour, smooth_shading=True, opacity=0.85, specular=0.4
                )
        else:
            cloud = pv.PolyData(np.asarray(frame.position, np.float32))
            cloud[field] = values_of(frame, field)
            plotter.add_mesh(
                cloud, name="fluid", scalars=field, clim=limits(run, look, field), cmap=colours, style="points",
                render_points_as_spheres=True, point_size=_size(plotter, scene.spacing / run.share ** (1 / 3)),
                scalar_bar_args={"title": caption(field), "color": "black", "n_labels": 3},
            )  # fmt: skip
        for n, (_, mesh) in enumerate(run.bodies(frame.time)):
            plotter.add_mesh(_poly(pv, mesh), name=f"body{n}", color=mesh.colour)
        plotter.add_text(f"{scene.name}, t = {frame.time:.2f} s", name="time", font_size=12, color="black")
        yield np.asarray(plotter.screenshot(return_img=True))[..., :3]
    plotter.close()


def _poly(pv, mesh: Mesh):
    cells = np.column_stack([np.full(len(mesh.cells), mesh.cells.shape[1]), mesh.cells])
    return pv.PolyData(np.asarray(mesh.vertices, np.float32), cells.ravel())


def _eye(low: np.ndarray, high: np.ndarray) -> tuple[float, ...]:
    """Place and target of a camera that sees the whole tank from the front, above."""
    centre, size = (low + high) / 2, np.linalg.norm(high - low)
    return (*(centre + 1.35 * size * np.array([-0.45, -0.8, 0.42])), *centre)


def _size(plotter, spacing: float) -> float:
    """Diameter of a particle in pixels."""
    camera = plotter.camera
    height = 2 * camera.distance * np.tan(np.radians(camera.view_angle) / 2)
    return max(1.0, 1.5 * spacing / height * plotter.window_size[1])
