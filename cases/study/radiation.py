"""Added mass and radiation damping from forced oscillation: a joint moves as X sin(omega t), and the fluid's force on every
joint, less that of still water in the same pose, is -A x'' - B x' (Faltinsen 1990, eq. 3.20).

The routine `radiation` has keys of its own, which become those of a scene with prescribed motion: `radiation.joint`,
`radiation.omega` [rad/s] (or `period` [s], `frequency` [Hz]), `radiation.amplitude` [m or rad] (`radiation.amplitude.JOINT` of
one joint), and how many periods go by: `radiation.ramp` (1), then one to settle, and `radiation.periods` (4) that are measured.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from cases.report.figure import Figure
from cases.report.wave_figures import harmonic, mean_and_error
from cases.study.carriage import MOTIONS, carried
from cases.study.plan import Parameter, Study
from fsi.errors import SceneError
from fsi.scene.file import load_scene
from fsi.scene.model import Scene

PREFIX = "radiation."
SPEEDS = {"omega": lambda x: x, "period": lambda x: 2 * math.pi / x, "frequency": lambda x: 2 * math.pi * x}
KEYS = ("joint", "amplitude", "ramp", "periods", *SPEEDS)
SETTLE = 1.0  # periods after the ramp that are left out
SHORT = 0.05  # of a period, that the last frame may lack
SAMPLES, FEWEST = 60, 16  # a period: as many are logged; with fewer there is no result
RANGE = (0.3, 3.0)  # omega^2 a / g of the frequencies that are chosen where none are given, a the size of the body
COUNT = 6  # of them
SHARE = 0.1  # amplitude over the size of the body, where none is given


def forced(keys: Mapping[str, object], scene: Scene) -> dict[str, object]:
    """The keys of a study with those of `radiation` replaced by keys of the scene: one joint that oscillates, in water without
    waves, and nothing that acts on the bodies besides. Raises SceneError for a key that is missing or unknown."""
    own = {key.removeprefix(PREFIX): value for key, value in keys.items() if key.startswith(PREFIX)}
    rest = {key: value for key, value in keys.items() if not key.startswith(PREFIX)}
    own["amplitude"] = own.pop(f"amplitude.{own.get('joint')}", own.get("amplitude", ""))
    own = {name: value for name, value in own.items() if not name.startswith("amplitude.") and value != ""}
    if odd := [name for name in own if name not in KEYS]:
        raise SceneError("unknown key", key=PREFIX + odd[0], fix=f"use {', '.join(KEYS)}")
    speeds = [name for name in SPEEDS if name in own]
    if len(speeds) != 1:
        raise SceneError(
            f"{len(speeds)} of {', '.join(SPEEDS)} are given", key=PREFIX + "omega", fix="give one of them"
        )
    for name, fix in (
        ("joint", 'name one, e.g. under [set]: radiation.joint = "heave"'),
        ("amplitude", "give it in m or rad"),
    ):
        if name not in own:
            raise SceneError("missing", key=PREFIX + name, fix=fix)
    for name, value in own.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if name != "joint" and not (number and (value > 0 or (name == "ramp" and value == 0))):
            raise SceneError(f"is {value!r}", key=PREFIX + name, fix="give a positive number")
    omega = SPEEDS[speeds[0]](own[speeds[0]])
    period, ramp = 2 * math.pi / omega, float(own.get("ramp", 1.0))
    motion = {"amplitude": own["amplitude"], "omega": omega, "ramp": ramp * period}
    away = {f"bodies.{name}.{key}": "" for name, body in scene.bodies.items() for key in _acting(body)}
    away |= {key: "" for key in ("waves", "sea") if getattr(scene, key, None)}
    coupler = {"scheme": "prescribed", "motion": {str(own["joint"]): motion}}
    duration = (ramp + SETTLE + own.get("periods", 4)) * period
    for key in rest:
        if key.split(".")[0] in ("coupler", "waves", "sea", "duration"):
            raise SceneError("has no effect on forced oscillation", key=key, fix="remove it")
    times = {"duration": float(f"{duration:.9g}")}
    if scene.output.series and scene.output.series > period / SAMPLES:
        times["output.series"] = float(f"{period / SAMPLES:.3g}")
    return {**rest, **away, **times, "coupler": coupler}


def _acting(body) -> Iterator[str]:
    """What of a body file prescribed motion has no use for."""
    for key in ("pto", "moorings"):
        if getattr(body, key, None):
            yield key
    if getattr(body, "start", "drawn") != "drawn":
        yield "start"


def radiation_figures(data, scene: Scene, start: float | None = None) -> Iterator[Figure]:
    """Figures of a run with one oscillating joint, along `joint`, on which the force acts: `added_mass` and
    `radiation_damping`, each with the half width of its 95 % confidence interval over the periods. Raises SceneError where the
    run is too short, or its bodies cannot be loaded."""
    from bodies import load

    [(moved, motion)] = scene.coupler.motion.items()
    period = 2 * math.pi / motion.omega
    begin = motion.ramp + SETTLE * period if start is None else start
    end = float(data.time[-1]) if data.sizes["time"] else 0.0
    count = math.floor((end - begin) / period + SHORT)
    part = data.sel(time=slice(end - count * period - 1e-9, None))
    if count < 1 or part.sizes["time"] < FEWEST * count:
        fault = f"{max(end - begin, 0):.3g} s are left after the start-up, with {part.sizes['time']} samples"
        raise SceneError(fault, key="radiation.periods", fix=f"give a whole period, and {FEWEST} samples in it")
    bodies = load(scene)
    time, position, force = forces(part, bodies)
    names = list(map(str, bodies.joint_names))
    estimates = np.empty((count, len(names)), complex)
    edges = end - period * np.arange(count, -1, -1)
    for n, (a, b) in enumerate(pairwise(edges)):
        here = (time > a) & (time <= b)
        x = harmonic(time[here], position[here, names.index(moved)], motion.omega)
        estimates[n] = [harmonic(time[here], force[here, j], motion.omega) / x for j in range(len(names))]
    units = _units(bodies.joint_is_rotary)
    figures = (
        ("added_mass", estimates.real / motion.omega**2, units[0], "added mass"),
        ("radiation_damping", -estimates.imag / motion.omega, units[1], "radiation damping"),
    )
    for key, values, unit, words in figures:
        for j, name in enumerate(names):
            mean, error = mean_and_error(values[:, j], count)
            yield Figure(key, mean, unit, words, "joint", name)
            yield Figure(f"{key}_error", error, unit, f"95 % confidence of the {words}", "joint", name)


def forces(part, bodies) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) [s], joint positions (n, joints) and the fluid's force on each joint less that of still water (n, joints).

    The log has the force of the step that ends at its time: its hydrostatic part is that of the pose at the start of the step,
    the acceleration that it answers to is that of the middle.
    """
    names, dofs = list(map(str, bodies.joint_names)), list(bodies.joint_dof)
    step, time = part.time_step.values, part.time.values
    velocity = part.joint_velocity.values
    acceleration = np.gradient(velocity, time, axis=0)

    def before(h: np.ndarray) -> np.ndarray:
        h = h[:, None]
        return part.joint_position.values - h * velocity + h**2 / 2 * acceleration

    wrench = np.concatenate([part.body_force.values, part.body_torque.values], axis=2)
    still, force = bodies.buoyancy(), np.empty((len(time), len(names)))
    for n, row in enumerate(before(step)):
        bodies.place(dict(zip(names, row, strict=True)), {})
        force[n] = np.einsum("bij,bi->j", bodies.motion().jacobian, wrench[n] - still())[dofs]
    return time - 0.5 * step, before(0.5 * step), force


def _units(rotary) -> tuple[str, str]:
    """Of added mass and damping of these joints."""
    if all(rotary):
        return "kg m2", "N m s/rad"
    return ("kg or kg m or kg m2", "N s/m or N s or N m s/rad") if any(rotary) else ("kg", "N s/m")


def _refuse_study(file: Path) -> None:
    """Raise SceneError for a file that is a study, not a scene."""
    try:
        scene = tomllib.loads(file.read_text(encoding="utf-8")).get("scene")
    except (OSError, ValueError):  # a built-in name, or what `load_scene` refuses by its own words
        return
    if isinstance(scene, str):
        fix = f"give --radiation the scene itself, {scene}, or run the study without --radiation"
        raise SceneError("is a study, not a scene", file=file, fix=fix)


def radiation_study(source: str | Path) -> Study:
    """A study of every hinge and slide joint of a scene, and every motion of its free bodies, over frequencies and with
    amplitudes that suit the size of its bodies. Raises SceneError for a scene in which nothing moves."""
    from bodies import load

    _refuse_study(Path(source))
    scene = load_scene(source)
    bodies = load(scene) if scene.bodies else None
    turns = dict(zip(map(str, bodies.joint_names), bodies.joint_is_rotary, strict=True)) if bodies else {}
    for body, (_, names) in carried(scene).items():
        before = f"{body}/" if len(scene.bodies) > 1 else ""
        turns |= {before + name: MOTIONS[name.split()[-1]][0] == "hinge" for name in names}
    joints = list(turns)
    if not joints:
        fix = "give a body that moves, with slide, hinge or free joint"
        raise SceneError("no joint to move by force", key="bodies", file=Path(source).name, fix=fix)
    volume = sum(pose["drawn"]["displaced_mass"] for pose in bodies.hydrostatics().values()) / scene.fluid.density
    if not volume > 0:
        raise SceneError(
            "no body that displaces water", key="bodies", file=Path(source).name, fix="draw it in the water"
        )
    size = volume ** (1 / 3) if scene.dimension == 3 else math.sqrt(volume / scene.tank.width)
    slide = max(SHARE * size, scene.spacing)
    amplitude = {name: slide / (size if turn else 1.0) for name, turn in turns.items()}
    low, high = (float(f"{math.sqrt(ka * scene.gravity / size):.3g}") for ka in RANGE)
    grid = Parameter(
        key="radiation.omega", min=low, max=high, count=COUNT, scale="log", units="rad/s", description="frequency"
    )
    grid = grid.model_copy(update={"values": tuple(float(f"{v:.4g}") for v in grid.grid()), "min": None, "max": None})
    return Study(
        name=f"{scene.name}_radiation",
        description=f"Added mass and radiation damping of {scene.name}",
        scene=str(source),
        routine="radiation",
        set={f"radiation.amplitude.{name}": float(f"{value:.3g}") for name, value in amplitude.items()},
        parameters={"driven": Parameter(key="radiation.joint", values=tuple(joints), description="joint that is moved"),
                    "omega": grid},
    )  # fmt: skip
