"""Values that were asked for and have no effect: one table, from key to the condition under which nothing comes of it.

Only values that differ from their defaults count as asked for, so that a scene with every default written out says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from pydantic import BaseModel

from fsi.errors import SceneError
from fsi.extras import installed
from fsi.protocols import BodySet, Solid
from fsi.scene.coupler import CouplerSettings
from fsi.scene.model import GRIDS, LinearPto, Output, Scene
from fsi.scene.numerics import ACCURACY, Numerics, presets

Condition = Callable[[Scene, BaseModel], object]  # scene, the part that has the key -> why not, or something false


def _no_solids(scene: Scene) -> bool:
    return not (scene.tank.walls or scene.tank.bathymetry or scene.bodies)


def _walls(scene: Scene, tank) -> str:
    idle = [side for side in tank.walls if side[0] not in tank.axes or side[0] in tank.periodic]
    why = "the tank repeats itself along that axis" if tank.periodic else "a two-dimensional scene has no y axis"
    return f"{', '.join(idle)}: {why}" if idle else ""


def _grid(scene: Scene, part) -> str:
    path = scene.tank.bathymetry
    return "" if path and path.suffix.lower() in GRIDS else f"tank.bathymetry is no grid ({', '.join(GRIDS)})"


def _level(scene: Scene, fluid) -> str:
    read = scene.waves or scene.gauges or any(body.glued_layers for body in scene.bodies.values())
    return "" if not fluid.blocks or read else "the blocks say where the fluid is, and no gauge or wave refers to it"


def _accuracy(scene: Scene, numerics) -> str:
    preset = ACCURACY.get(numerics.accuracy, {})
    own = preset and all(getattr(numerics, key) != value for key, value in preset.items())
    return f"all that it would choose is given: {', '.join(preset)}" if own else ""


def _inviscid(scene: Scene, part) -> str:
    return "numerics.viscosity is 'none'" if scene.numerics.viscosity == "none" else ""


def _only_implicit(scene: Scene, numerics) -> str:
    return "" if numerics.solver == "iisph" else "only the solver 'iisph' reads it"


def _wall_slip(scene: Scene, numerics) -> str:
    return _inviscid(scene, numerics) or (_no_solids(scene) and "there is no wall and no body")


def _smagorinsky(scene: Scene, numerics) -> str:
    if numerics.turbulence == "dynamic":
        return "numerics.turbulence is 'dynamic': the flow gives C_s"
    return "numerics.turbulence is 'none'" if numerics.turbulence == "none" else _inviscid(scene, numerics)


def _mach(scene: Scene, numerics) -> str:
    if scene.gravity == 0:
        return "without gravity there is no wave speed to compare with"
    if numerics.solver == "iisph" and not (numerics.artificial_viscosity or numerics.wall_friction):
        return "for 'iisph' it sets the speed of sound of artificial viscosity and wall friction, and both are 0"
    return _fixed_step(scene, numerics) if numerics.artificial_viscosity == 0 else ""


def _standing_pressure(scene: Scene, numerics) -> str:
    if numerics.solver == "iisph":
        return "'iisph' has its own sum over pairs"
    if scene.liquids:
        return "between liquids every pressure acts in pairs"
    return "" if scene.gravity or scene.fluid.acceleration else "without gravity no pressure stands"


def _fixed_step(scene: Scene, numerics) -> str:
    return "numerics.fixed_time_step sets the step" if numerics.fixed_time_step else ""


def _unlogged(output: Output) -> str:
    return "" if output.mcap or output.timeline else "output.mcap and output.timeline are both off"


def _unseen(output: Output) -> str:
    if not output.particles:
        return "output.particles is 0"
    return "" if output.timeline or (output.mcap and output.cloud) else "no stream takes particles"


def _instruments(scene: Scene, part) -> str:
    return _unlogged(scene.output) or (not scene.output.series and "output.series is 0")


def _table_starts_late(scene: Scene, part) -> str:
    from fsi.waves.kinds.table import TablePiston

    try:
        first = TablePiston(part.file).t[0]
    except SceneError:  # told of as a file
        return ""
    return (
        f"its first row is at {first:g} s, and the run ends at {scene.duration:g} s" if first >= scene.duration else ""
    )


def _starts_late(scene: Scene, waves) -> str:
    return f"the run ends at {scene.duration:g} s" if waves.start >= scene.duration else ""


def _idle_pto(scene: Scene, part) -> str:
    pto = getattr(part, "pto", part)  # one, which is here without a joint's name
    idle = isinstance(pto, LinearPto) and not (pto.damping or pto.stiffness)
    return "damping and stiffness are 0, so that it gives no force" if idle else ""


def _csv(scene: Scene, waves) -> str:
    return "a table (waves.format = 'csv') holds one spectrum" if waves.format == "csv" else ""


def _unbodied(scene: Scene, coupler) -> str:
    return "" if scene.bodies else "there are no bodies"


IDLE: dict[str, Condition] = {
    "tank.walls": _walls,
    "tank.width": lambda scene, tank: scene.dimension == 3 and "a three-dimensional tank has its width in min and max",
    "tank.grid": _grid,
    "fluid.kinematic_viscosity": _inviscid,
    "fluid.rheology": _inviscid,
    "liquids.*.kinematic_viscosity": _inviscid,
    "liquids.*.rheology": _inviscid,
    "fluid.still_water_level": _level,
    "fluid.acceleration": lambda scene, fluid: not any(fluid.acceleration) and "it is zero",
    "fluid.acceleration_gradient": lambda scene, fluid: not np.any(fluid.acceleration_gradient) and "it is zero",
    "fluid.start": lambda scene, fluid: not scene.gravity and fluid.start == "zero" and "there is no gravity",
    "waves.start": _starts_late,
    "waves.file": _table_starts_late,
    "sea.waves.ramp": lambda scene, waves: (
        scene.sea.start == "waves" and "the run starts under waves; sea.start = 'rest' has a ramp"
    ),
    "gauges.*": _instruments,
    "gauges.*.y": lambda scene, gauge: scene.dimension == 2 and "a two-dimensional scene has no y axis",
    "probes.*": _instruments,
    "velocimeters.*": _instruments,
    "velocimeters.*.points": lambda scene, meter: meter.end is None and "it has no end, so that it reads one point",
    "depths.*": _instruments,
    "depths.*.y": lambda scene, gauge: scene.dimension == 2 and "a two-dimensional scene has no y axis",
    "fluxes.*": _instruments,
    "runups.*": _instruments,
    "areas.*": _instruments,
    "loads.*": _instruments,
    "waves.time": _csv,
    "waves.site": _csv,
    "control.interval": lambda scene, control: (
        control.interval >= scene.duration and f"the run ends at {scene.duration:g} s, before a second call"
    ),
    "bodies.*.pto": _idle_pto,
    "bodies.*.pto.rest": lambda scene, pto: not pto.stiffness and "there is no spring: stiffness is 0",
    "coupler.scheme": _unbodied,
    "coupler.tolerance": lambda scene, coupler: (
        _unbodied(scene, coupler) or (coupler.scheme == "prescribed" and "prescribed motion has nothing to settle")
    ),
    "coupler.motion.*.file": _table_starts_late,
    "numerics.accuracy": _accuracy,
    "numerics.density_tolerance": _only_implicit,
    "numerics.lambda_max": lambda scene, numerics: (
        _only_implicit(scene, numerics)
        or _fixed_step(scene, numerics)
        or (not scene.gravity and "without gravity there is no free fall to compare with")
    ),
    "numerics.wall_friction": lambda scene, numerics: (
        _only_implicit(scene, numerics) or (not scene.gravity and "it acts by the speed of sound, none without gravity")
    ),
    "numerics.sweeps": lambda scene, numerics: (
        (numerics.solver == "iisph" and "'iisph' takes as many iterations as numerics.density_tolerance needs")
        or (numerics.solver == "converged" and _fixed_step(scene, numerics))
    ),
    "numerics.pressure_tolerance": lambda scene, numerics: (
        numerics.solver != "converged" and "only 'converged' has one"
    ),
    "numerics.wall_slip": _wall_slip,
    "numerics.viscous_step": _inviscid,
    "numerics.turbulence": _inviscid,
    "numerics.smagorinsky": _smagorinsky,
    "numerics.artificial_viscosity": lambda scene, numerics: (
        not scene.gravity and numerics.artificial_viscosity and "it acts by the speed of sound, none without gravity"
    ),
    "numerics.velocity_reconstruction": lambda scene, numerics: (
        not (scene.gravity and numerics.artificial_viscosity) and "there is no artificial viscosity"
    ),
    "numerics.shifting": lambda scene, numerics: (
        numerics.shifting == 0 and not scene.closed and "it is off beside a free surface anyway"
    ),
    "numerics.standing_pressure": _standing_pressure,
    "numerics.wall_guard": lambda scene, numerics: _no_solids(scene) and "there is no wall and no body",
    "numerics.mach": _mach,
    "numerics.courant": _fixed_step,
    "numerics.max_time_step": _fixed_step,
    "output.series": lambda scene, output: _unlogged(output),
    "output.particles": lambda scene, output: output.particles and _unseen(output),
    "output.fields": lambda scene, output: _unseen(output),
    "output.fraction": lambda scene, output: _unseen(output),
    "output.particles_limit": lambda scene, output: (
        _unseen(output) or (output.fraction is not None and "output.fraction is given")
    ),
    "output.values": lambda scene, output: (
        (not output.timeline and "output.timeline is off") or (not output.particles and "output.particles is 0")
    ),
    "output.cloud": lambda scene, output: (
        (not output.mcap and "output.mcap is off") or (not output.particles and "output.particles is 0")
    ),
}


def idle_values(scene: Scene) -> list[str]:
    """Values of the scene that were asked for and have no effect, one line each, with the reason."""
    lines = []
    for key, pattern, part in given(scene):
        if pattern in IDLE and (why := IDLE[pattern](scene, part)):
            lines.append(f"{key}: has no effect: {why}")
    return lines


def given(part: BaseModel, key: str = "", pattern: str = "") -> Iterator[tuple[str, str, BaseModel]]:
    """(key, pattern, part that has it) of every value that is not the default; in a pattern a name or number is `*`."""
    defaults = {name: field.get_default(call_default_factory=True) for name, field in type(part).model_fields.items()}
    if isinstance(part, Numerics):
        defaults |= presets(part.accuracy, part.solver)
    if isinstance(part, CouplerSettings):  # whose schemes have themselves as a default
        defaults["scheme"] = CouplerSettings.model_fields["scheme"].default
    for name, default in defaults.items():
        value = getattr(part, name)
        if value == default:
            continue
        here, like = f"{key}.{name}".lstrip("."), f"{pattern}.{name}".lstrip(".")
        yield here, like, part
        yield from _inside(value, here, like)


def _inside(value, key: str, pattern: str) -> Iterator[tuple[str, str, BaseModel]]:
    if isinstance(value, BaseModel):
        yield from given(value, key, pattern)
        return
    items = [(f".{name}", item) for name, item in value.items()] if isinstance(value, dict) else []
    items += [(f"[{n}]", item) for n, item in enumerate(value)] if isinstance(value, tuple) else []
    for step, item in items:
        if isinstance(item, BaseModel):
            like = pattern if pattern.endswith(".pto") else f"{pattern}.*"  # one, or one a joint
            yield key + step, like, item
            yield from given(item, key + step, like)


def idle_solids(scene: Scene, bodies: BodySet | None, ground: Solid | None) -> list[str]:
    """Values of bodies that nothing comes of once they are loaded, one line each. Raises SceneError where the whole bathymetry
    lies beside the tank."""
    if ground and not _meets(scene, ground):
        fix = "move it into the tank, and check its units: they are metres"
        raise SceneError("has no effect: no part of it lies in the tank", key="tank.bathymetry", fix=fix)
    glued = {name: body for name, body in scene.bodies.items() if body.glued_layers}
    idle = glued if bodies and not bodies.gaps() else {}
    lines = [f"bodies.{name}.glued_layers: has no effect: no body of the file moves" for name in idle]
    return [*lines, *getattr(ground, "notes", ())]


def _meets(scene: Scene, solid: Solid) -> bool:
    """Whether a solid has boundary particles where the fluid can feel them."""
    margin = scene.layers * scene.spacing
    points = solid.boundary(scene.spacing, scene.layers)
    return bool(
        ((points > np.array(scene.tank.min) - margin) & (points < np.array(scene.tank.max) + margin)).all(1).any()
    )


def no_timeline(scene: Scene) -> list[str]:
    """A warning where a scene would have a timeline if its package were installed."""
    if not scene.output.timeline or installed("rerun"):
        return []
    fix = "install it with: pip install 'spindrift[viewer]', or set output.timeline = false"
    return [f"output.timeline: no timeline and no pictures, the package 'rerun' is not installed; {fix}"]
