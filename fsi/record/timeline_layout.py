"""How the timeline looks when it is opened: the tank with a legend, the plots beside it, and the events."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsi.extras import require
from fsi.record.colours import colour_map, packed
from fsi.record.fields import CATEGORIES, spatial, top
from fsi.record.series import SERIES
from fsi.scene.fields import field_of
from fsi.scene.model import Scene

rr = require("rerun", "viewer", "output.timeline = true")
rrb = require("rerun.blueprint", "viewer", "output.timeline = true")

WIDE = 3.0  # length over height of a two-dimensional tank, above which it stands over the plots, not beside them
VIEW = 0.95  # distance of the eye, in heights of what it sees
PANE = {True: 4.4, False: 0.9}  # width over height of the pane of the tank, where that is wide or not
FIRST_CATEGORY = 256  # class of the first category; those below it are the steps of the colour map
BAR = 512  # length of the legend's colour bar, in its own units
CELLS = (  # one plot in view each, the others behind it in tabs; left out where the scene has none of its things
    ("joint_position", "joint_velocity"),
    ("body_position", "body_velocity"),
    ("body_force", "body_torque"),
    ("pto_power", "joint_force"),
    ("elevation",),
    ("pressure",),
    ("load_force", "load_torque"),
    ("discharge", "passed_volume"),
    ("velocity",),
    ("runup_height", "wet_area", "layer_thickness"),
    ("sensor_reading",),
    ("energy", "potential_energy", "volume"),
    ("time_step", "max_speed", "pressure_residual"),
)
ENERGIES = ("kinetic_energy", "dissipated_energy", "body_work", "wavemaker_work")
MOST_CELLS = 8


def blueprint(scene: Scene, names: dict[str, list[str]], unit: Callable[[str], str], note: str, live: bool):
    """The layout for a scene: `names` along each dimension of the series, `unit` of a series, a `note` over the tank. A
    live view follows the newest data, another one plays in a loop."""
    low, high = spatial(np.array([scene.tank.min, scene.tank.max]))
    size = high - low
    wide = scene.dimension == 2 and size[0] > WIDE * size[2]
    world = [_world(scene, field, note, low, high, wide) for field in scene.output.fields]
    world = rrb.Tabs(*world) if len(world) > 1 else world[0]
    cells = [cell for titles in CELLS if (cell := _cell(titles, names, unit))]
    if names.get("joint"):  # the bodies' motion can be told from their joints
        cells.pop(1)
    events = rrb.TextLogView(
        name="events",
        origin="events",
        columns=rrb.TextLogColumns(timeline_columns=["sim_time"], text_log_columns=["loglevel", "body"]),
    )
    plots = rrb.Grid(*cells[:MOST_CELLS], grid_columns=4 if wide else 2)
    if wide:
        panes = rrb.Vertical(world, plots, events, row_shares=[5, 5, 2])
    else:
        panes = rrb.Horizontal(world, rrb.Vertical(plots, events, row_shares=[4, 1]))
    play = {"play_state": "following"} if live else {"play_state": "playing", "loop_mode": "all"}
    return rrb.Blueprint(panes, rrb.TimePanel(timeline="sim_time", state="collapsed", **play), collapse_panels=True)


def _world(scene: Scene, field: str, note: str, low: np.ndarray, high: np.ndarray, wide: bool):
    """The tank with its particles coloured by a field, over the legend of it."""
    from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

    centre, size = (low + high) / 2, high - low
    if scene.dimension == 2:  # as near as shows all of it, in a pane of about the shape that the layout gives it
        away = np.array([0.0, -VIEW * max(1.1 * size[0] / PANE[wide], 1.2 * size[2]), 0.0])
    else:
        away = 0.9 * np.linalg.norm(size) * np.array([-0.5, -0.8, 0.45])
    eye = rrb.EyeControls3D(position=centre + away, look_target=centre, eye_up=(0, 0, 1))
    other = {}
    if field != scene.output.fields[0]:
        mapping = VisualizerComponentMapping(
            "Points3D:class_ids", ComponentSourceKind.SourceComponent, source_component=field
        )
        other = {"overrides": {"world/fluid": rr.Points3D.from_fields().visualizer(mappings=[mapping])}}
    view = rrb.Spatial3DView(name=f"{scene.name}{note}", origin="world", eye_controls=eye, line_grid=False, **other)
    legend = rrb.Spatial2DView(
        name=f"{field} legend",
        origin=f"legend/{field}",
        titlebar=False,
        visual_bounds=rrb.VisualBounds2D(x_range=[-0.35 * BAR, 1.35 * BAR], y_range=[-14, 46]),
    )
    return rrb.Vertical(view, legend, row_shares=[4, 1] if wide else [8, 1], name=titled(field, field_of(field).units))


def _cell(titles: tuple[str, ...], names: dict[str, list[str]], unit: Callable[[str], str]):
    views = [view for title in titles if (view := _plot(title, names, unit))]
    return rrb.Tabs(*views) if len(views) > 1 else views[0] if views else None


def _plot(title: str, names: dict[str, list[str]], unit: Callable[[str], str]):
    members = ENERGIES if title == "energy" else (title,)
    dims = SERIES[members[0]].dims if members[0] in SERIES else None
    if dims is None or not all(names.get(dim) for dim in dims):
        return None
    lines = len(members) * int(np.prod([len(names[dim]) for dim in dims]))
    return rrb.TimeSeriesView(
        name=titled(title, unit(members[0])),
        origin="series",
        contents=[f"+ /series/{name}" for name in members],
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=lines > 1),
    )


def titled(name: str, units: str) -> str:
    """A name with its units, as it stands over a plot."""
    return name.replace("_", " ") + (f" [{units}]" if units and units != "1" else "")


def classes(scene: Scene) -> list:
    """Colours of the particles' classes: the steps of the colour map, then the categories."""
    colours = np.concatenate([colour_map(), CATEGORIES])
    return [rr.AnnotationInfo(id=n, color=colour.tolist()) for n, colour in enumerate(colours)]


def class_of(field: str, level: np.ndarray) -> np.ndarray:
    """Classes (n,) uint16 of the levels (n,) of a field, see `fsi.record.fields.levels`."""
    if field_of(field).names:
        return FIRST_CATEGORY + level.astype(np.uint16) % len(CATEGORIES)
    return level.astype(np.uint16)


def log_legend(stream, scene: Scene, field: str) -> None:
    """The legend of a field under `legend/FIELD`: a colour bar with three figures, or a patch for each category."""
    path, facts = f"legend/{field}", field_of(field)
    if facts.names:
        found = facts.names(scene)
        places = (np.arange(len(found)) + 0.5) * BAR / len(found)
        colours, labels = packed(CATEGORIES[np.arange(len(found)) % len(CATEGORIES)]), found
        boxes = rr.Boxes2D(centers=[(x, 0) for x in places], sizes=[(24, 12)] * len(found), colors=colours)
        stream.log(f"{path}/bar", rr.Boxes2D.from_fields() if not found else boxes, static=True)
    else:
        bar = np.repeat(np.repeat(colour_map()[None], BAR // 256, axis=1), 12, axis=0)
        stream.log(f"{path}/bar", rr.Image(bar), static=True)
        places, highest = np.array([0.0, 0.5, 1.0]) * BAR, top(scene, field)
        labels = [f"{share * highest:.4g} {facts.units}" for share in (0.0, 0.5, 1.0)]
    text, points = [*labels, field.replace("_", " ")], [*((x, 20) for x in places), (-0.16 * BAR, 4)]
    ghost = {"radii": [0.01], "colors": [0x707070FF], "show_labels": True}
    stream.log(f"{path}/labels", rr.Points2D(points, labels=text, **ghost), static=True)
