"""The page of a run: what was run, its key figures, time series, snapshots, books, phase times, warnings and events."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cases.report import charts, wave_figures
from cases.report.figure import exceeded
from cases.report.froude import check_scale, power
from cases.report.largest import largest_load
from cases.report.page import Page, Section
from cases.report.scene_facts import scene_facts
from cases.report.snapshot import snapshot_figure
from fsi.errors import SceneError
from fsi.progress import clock
from fsi.record.dataset import frames_of
from fsi.record.manifest import read_manifest
from fsi.scene.file import load_scene
from fsi.scene.model import Scene

SERIES = (  # title, variables; one figure each where the run has them
    ("Joints", ("joint_position", "joint_velocity", "joint_force", "pto_power")),
    ("Loads of the fluid on the bodies", ("body_force", "body_torque")),
    ("Sensors", ("sensor_reading",)),
    ("Waves", ("elevation",)),
    ("Pressure", ("pressure",)),
    ("Loads on fixed structures", ("load_force", "load_torque", "load_centre")),
    ("Discharge", ("discharge", "passed_volume")),
    ("Velocity", ("velocity",)),
    ("Run-up and flooding", ("runup_height", "runup_distance", "wet_area", "inundation_depth", "layer_thickness")),
    ("Motion of the bodies", ("displacement",)),
)
ENERGIES = ("kinetic_energy", "dissipated_energy", "body_work", "wavemaker_work")
NUMERICS = ("time_step", "max_speed")
FAR = ("load_centre",)  # goes to infinity where the force goes through zero: drawn as far as 96 % of its values
MOST_LINES, MOST_POINTS = 8, 4000  # in one panel
SMALL = 1e-9  # share of the largest component, below which one is left out of a plot
SNAPSHOTS = 4


def report(folder: str | Path, *, scale: float | None = None) -> Path:
    """Write `report.html` and its PNGs (`report/`) into the folder of a run; returns the page. With `scale`, full size over
    model, the key figures stand beside those at full scale by Froude's law.

    Raises SceneError where the folder holds no run or no log."""
    folder = Path(folder)
    facts, data = read_manifest(folder), frames_of(folder)
    scene = load_scene(folder / "scene.toml")
    page = Page(scene.name, scene.description or f"{scene.dimension}D run of {facts.get('simulated_seconds', 0):g} s")
    _summary(page.section("Summary"), scene, facts)
    if data.attrs["damage"]:
        page.section("Damage").text(data.attrs["damage"])
    seconds = _figures(page.section("Key figures"), data, scene, scale)
    _series(page.section("Time series"), data)
    _snapshots(page.section("Particles"), folder, data, scene)
    largest_load(page, folder, data, scene, seconds)
    _books(page.section("Energy and momentum"), data, facts)
    _cost(page.section("Run time"), facts)
    _events(page.section("Warnings and events"), data, facts)
    page.section("Scene").code((folder / "scene.toml").read_text(encoding="utf-8"))
    return page.write(folder / "report.html", folder / "report")


def _summary(section: Section, scene: Scene, facts: dict) -> None:
    machine, particles, threads = facts["machine"], facts.get("particles", {}), facts.get("threads", "?")
    status = facts["status"] + (f": {facts['reason']}" if facts["reason"] else "")
    section.facts(
        {
            "status": status,
            **scene_facts(scene),
            "particles": ", ".join(f"{count:,} {kind}" for kind, count in particles.items()),
            "simulated": f"{facts.get('simulated_seconds', 0.0):.4g} s in {facts.get('steps', 0):,} steps",
            "run time": f"{clock(facts.get('wall_seconds', 0.0))} on {threads} thread{'s' * (threads != 1)}",
            "machine": f"{machine['processor']}, {machine['cores']} cores",
            "started": facts["started"][:19].replace("T", " ") + " UTC",
            "versions": ", ".join(f"{name} {number}" for name, number in facts["versions"].items()),
        }
    )


def key_figures(data, scene: Scene) -> tuple[list, float, str]:
    """Response, power and loads in settled waves, of a run without waves over all of it; the seconds they are taken from, and
    which those are in words. A run that ends before the waves have settled has loads and elevations alone."""
    start = None if scene.waves else 0.0
    try:
        found = wave_figures.figures(data, scene, start=start)
        seconds = wave_figures.measured_seconds(data, scene, start)
        which = (
            f"the last {seconds:.4g} s, in which the waves have come to the body or structure" if scene.waves else ""
        )
        return found, seconds, which or f"all {seconds:.4g} s"
    except SceneError:
        end = float(data.time[-1]) if data.sizes["time"] else 0.0
        begin = wave_figures.jolt(scene) if scene.waves else 0.0
        begin = begin if begin < end else 0.0
        kept = ("_max", "_peak", "_1pct", "_static", "_rms", "discharge_mean", "per_metre", "end_stop", "end_stop_hits")
        found = [figure for figure in _whole(data, scene, begin) if figure.name.endswith(kept)]
        return (
            found,
            end - begin,
            f"all {end:.4g} s" if begin == 0.0 else f"all but the first {begin:.2g} s of the start",
        )


def _figures(section: Section, data, scene: Scene, scale: float | None) -> float:
    """The table of key figures, at full scale too where that is asked for; returns the seconds they are taken from."""
    found, seconds, which = key_figures(data, scene)
    if scene.waves and not which.startswith("the last"):
        section.text(
            "The run ends before the waves have settled at the body or structure and gone through a whole period there: no "
            f"response and no mean power. Loads are over {which}."
        )
    errors = {f.key: f.value for f in found if f.name.endswith("_error")}
    rows = []
    for figure in found:
        if figure.name.endswith("_error"):
            continue
        error = errors.get(figure.key.replace(figure.name, f"{figure.name}_error"), np.nan)
        margin = f" ± {error:.2g}" if np.isfinite(error) else ""
        rows.append([figure.long_name, figure.label, f"{figure.value:.4g}{margin}", figure.units])
    rows += _sensor_rows(data, seconds)
    heads = ["figure", "of", "value", "unit"]
    if scale is not None:
        heads.append(f"at {check_scale(scale):g} times the size")
        rows = [[*row, _full(row, scale)] for row in rows]
    caption = (
        f"Over {which}; ± is the 95 % confidence interval of a mean; static is the mean of the middle half of the values, "
        "dynamic the rest"
    )
    section.table(heads, rows, caption=caption)
    if why := wave_figures.not_separated(data, scene) if scene.waves else "":
        section.text(f"Incident and reflected waves are not told apart: {why}.")
    if scale is not None:
        section.text("Full scale is by Froude's law in water of the same density; viscous forces do not go by it.")
    return seconds


def _full(row: list[str], scale: float) -> str:
    n = power(row[3])
    return "unknown unit" if n is None else f"{float(row[2].split()[0]) * scale**n:.4g} {row[3]}"


def _whole(data, scene: Scene, start: float) -> list:
    try:
        return wave_figures.figures(data, scene.model_copy(update={"waves": None}), start=start)
    except SceneError:
        return []


def _sensor_rows(data, seconds: float) -> list[list[str]]:
    """Peak and 1 % exceedance of every sensor of the MJCF file, hinge reactions among them."""
    if "sensor_reading" not in data:
        return []
    part = data.sensor_reading.sel(time=slice(float(data.time[-1]) - seconds - 1e-9, None))
    rows = []
    for name in map(str, part.sensor.values):
        values, unit = np.abs(part.sel(sensor=name).values), part.attrs["units"]
        rows.append(["largest reading", name, f"{values.max():.4g}", unit])
        rows.append(["reading exceeded 1 % of the time", name, f"{exceeded(values):.4g}", unit])
    return rows


def _series(section: Section, data) -> None:
    if "body_position" in data and data.sizes["time"]:
        data = data.assign(displacement=data.body_position - data.body_position.isel(time=0))
        data["displacement"].attrs = {"units": "m", "long_name": "displacement of the centre of mass since the start"}
    for title, names in SERIES:
        present = [name for name in names if name in data and data[name].size]
        if not present:
            continue
        figure, panels = charts.canvas(len(present), height=2.6)
        for panel, name in zip(panels, present, strict=True):
            plot(panel, data, name)
        section.figure(figure, title, name=present[0])


def plot(panel, data, name: str) -> None:
    """All lines of a series over time, but those that stay at zero; no more than fit a legend."""
    variable = data[name]
    values = variable.values.reshape(len(data.time), -1)
    labels = [""] if variable.ndim == 1 else _labels(data, variable.dims[1:])
    largest = np.nanmax(np.abs(values), axis=0, initial=0.0)
    shown = [n for n in range(values.shape[1]) if largest[n] > SMALL * max(largest.max(), 1e-300)][:MOST_LINES] or [0]
    every = max(1, len(data.time) // MOST_POINTS)
    units = variable.attrs["units"]
    charts.lines(
        panel,
        data.time.values[::every],
        [values[::every, n] for n in shown],
        [labels[n] for n in shown],
        xlabel="time [s]",
        ylabel=f"{name.replace('_', ' ')} [{units}]",
        title=variable.attrs["long_name"] + (f", {labels[shown[0]]}" if len(shown) == 1 and labels[shown[0]] else ""),
    )
    if name in FAR and np.isfinite(values[:, shown]).any():
        low, high = np.nanquantile(values[:, shown], (0.02, 0.98))
        panel.set_ylim(low - 0.1 * (high - low or 1.0), high + 0.1 * (high - low or 1.0))


def _labels(data, dims) -> list[str]:
    along = [[str(n) for n in (data[dim].values if dim in data.coords else range(data.sizes[dim]))] for dim in dims]
    return [" ".join(names[i] for names, i in zip(along, index, strict=True)) for index in np.ndindex(*map(len, along))]


def _snapshots(section: Section, folder: Path, data, scene: Scene) -> None:
    """Particles at a few times; the largest impact is one of them."""
    times = list(np.linspace(0.0, float(data.time[-1]) if data.sizes["time"] else 0.0, SNAPSHOTS))
    impacts = [float(t) for t, text in zip(data.event_time, data.event_text.values, strict=True) if "impact" in text]
    try:
        figure, caption = snapshot_figure(folder / "run.rrd", sorted({*times, *impacts[:2]}), data, scene)
    except SceneError as fault:
        section.text(f"No snapshots: {fault}")
        return
    section.figure(figure, caption, name="particles")


def _books(section: Section, data, facts: dict) -> None:
    figure, [energies, steps, speed] = charts.canvas(3, height=2.6)
    time = data.time.values
    charts.lines(
        energies,
        time,
        [data[name].values for name in ENERGIES],
        [name.replace("_", " ") for name in ENERGIES],
        xlabel="time [s]",
        ylabel="energy [J]",
        title="where the energy goes",
    )
    for panel, name in zip((steps, speed), NUMERICS, strict=True):
        plot(panel, data, name)
    section.figure(figure, "Energy, time step and largest speed", name="energy")
    audit = dict(facts.get("audit", {}))
    volume = data["volume"].values
    rows = [
        [
            "momentum residual, largest, as a share of the fluid's weight times the step",
            audit.get("momentum_residual"),
            "1",
        ],
        [
            "force on the bodies against what the fluid gave, largest difference, as a share of the largest",
            audit.get("body_impulse_residual"),
            "1",
        ],
        [
            "work the fluid lost beyond what was exchanged and the sponge took, as a share",
            audit.get("work_residual"),
            "1",
        ],
        ["energy at the start", audit.get("energy_at_start"), "J"],
        ["work of the wavemaker on the fluid", audit.get("wavemaker_work"), "J"],
        ["work of the fluid on the bodies", audit.get("body_work"), "J"],
        ["dissipated in the fluid", audit.get("dissipated_energy"), "J"],
        ["kinetic energy at the end", audit.get("kinetic_energy"), "J"],
        ["potential energy at the end", audit.get("potential_energy"), "J"],
        [
            "volume at the end over that at the start, less one",
            volume[-1] / volume[0] - 1 if len(volume) else None,
            "1",
        ],
        ["particles lost", float(data["lost_particles"].values[-1]) if len(volume) else None, "1"],
    ]
    shown = [[name, f"{value:.4g}", unit] for name, value, unit in rows if value is not None]
    section.table(["book", "value", "unit"], shown, caption="Balance of the run")


def _cost(section: Section, facts: dict) -> None:
    phases = sorted(facts.get("phases", {}).items(), key=lambda item: -item[1])
    if not phases:
        return
    total = sum(seconds for _, seconds in phases)
    figure, [panel] = charts.canvas(height=0.6 + 0.34 * len(phases))
    names, seconds = zip(*reversed(phases), strict=True)
    bars = panel.barh(names, seconds, color=charts.COLOURS[0])
    panel.bar_label(bars, [f"{s:.3g} s, {100 * s / total:.3g} %" for s in seconds], padding=4, fontsize=11)
    panel.set(xlabel="wall time [s]", xlim=(0, 1.2 * max(seconds)))
    panel.grid(axis="y", visible=False)
    section.figure(figure, "Wall time of the phases of a step, summed over the run", name="phases")
    steps = max(facts.get("steps", 1), 1)
    fluid = facts.get("particles", {}).get("fluid", 0)
    section.facts(
        {
            "time of a step": f"{1000 * total / steps:.3g} ms",
            "speed": f"{fluid * steps / total / 1e6:.3g} million particle-steps a second",
            "memory of the particles": f"{facts.get('memory_bytes', 0) / 1e6:.3g} MB",
        }
    )


def _events(section: Section, data, facts: dict) -> None:
    if facts.get("warnings"):
        section.items([("warning", line) for line in facts["warnings"]])
    told = set(facts.get("warnings", ()))
    rows = [
        [f"{float(time):.4f}", level, text]
        for time, level, text in zip(data.event_time, data.event_level.values, data.event_text.values, strict=True)
        if text not in told
    ]
    section.table(["time [s]", "level", "what happened"], rows, caption="Events")
