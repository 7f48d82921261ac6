"""One MJCF file as MuJoCo's specification, with the options that a body in a fluid may have."""

from __future__ import annotations

import math
from collections import Counter

import mujoco
import numpy as np

from bodies import world
from bodies.assets import assets
from bodies.sizes import check_file
from fsi.errors import SceneError
from fsi.scene.model import BodyFile
from fsi.trust import check_bytes

OFF, ON, INTEGRATOR = mujoco.mjtDisableBit, mujoco.mjtEnableBit, mujoco.mjtIntegrator
LEAST_STEP = 1e-6  # [s]
MOST_BYTES = 500e6  # of a mesh, a height field or a texture
SWITCHED_OFF = {  # flag -> what a file that disables it goes without
    OFF.mjDSBL_CONSTRAINT: (
        "constraint",
        "joint limits, contacts, joint friction and equality constraints do not hold",
    ),
    OFF.mjDSBL_EQUALITY: ("equality", "equality constraints do not hold"),
    OFF.mjDSBL_FRICTIONLOSS: ("frictionloss", "joints have no dry friction"),
    OFF.mjDSBL_LIMIT: ("limit", "joint and tendon limits do not hold"),
    OFF.mjDSBL_CONTACT: ("contact", "geoms pass through each other"),
    OFF.mjDSBL_SPRING: ("spring", "joint and tendon springs do not act"),
    OFF.mjDSBL_DAMPER: ("damper", "joint and tendon dampers do not act"),
    OFF.mjDSBL_ACTUATION: ("actuation", "actuators do not act"),
    OFF.mjDSBL_SENSOR: ("sensor", "sensors read 0"),
}
NOT_HERE = {  # flags that act in MuJoCo's own step alone
    ON.mjENBL_SLEEP: "sleep",
    ON.mjENBL_IPC: "ipc",
    ON.mjENBL_SPECULATIVE: "speculative",
}


def read(file: BodyFile, gravity: float, key: str, source: object, notes: list[str]) -> mujoco.MjSpec:
    """The file as it stands, with a name for every body, geom, joint and actuator; `notes` gains what was decided.

    gravity [m/s2] is the scene's; key and source name the place of the file in the scene.
    Raises SceneError for a missing or malformed file and for options that contradict the scene.
    """
    path = file.mjcf
    if not path.is_file():
        fix = "give the path of an MJCF file, or package://bodies/models/NAME.xml for one that comes with the project"
        raise SceneError(f"no file {str(path)!r}", key=key, file=source, fix=fix)
    check_file(path)
    for asset in assets(path):
        check_bytes(asset, MOST_BYTES, "make it smaller, e.g. a mesh of fewer triangles")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise SceneError(one_line(error), file=path, fix="correct the MJCF") from None
    _check_numbers(path)
    option = spec.option
    if option.density or option.viscosity or np.any(option.wind):
        fault, fix = "MuJoCo's own fluid model is on", "remove density, viscosity and wind: the fluid would act twice"
        raise SceneError(fault, key="option", file=path, fix=fix)
    _check_gravity(option, gravity, path)
    if not 0.0 < option.timestep < math.inf:
        fault, fix = f"timestep is {option.timestep:g} s", "give it a positive value, or leave it out"
        raise SceneError(fault, key="option", file=path, fix=fix)
    if option.timestep < LEAST_STEP:
        fault = f"timestep is {option.timestep:g} s: a step of the fluid would take thousands of them"
        raise SceneError(fault, key="option", file=path, fix=f"give {LEAST_STEP:g} s or more, or leave it out")
    notes += _flags(option, path.name)
    _name(spec)
    if option.integrator == INTEGRATOR.mjINT_EULER:  # MuJoCo's default
        option.integrator = INTEGRATOR.mjINT_IMPLICITFAST
    elif option.integrator == INTEGRATOR.mjINT_RK4:
        option.integrator = INTEGRATOR.mjINT_IMPLICITFAST
        notes.append(
            "integrator RK4 replaced by implicitfast: the fluid's inertia and stiff forces are taken implicitly"
        )
    return spec


def settle(spec: mujoco.MjSpec, file: BodyFile) -> None:
    """Move a file to its place in the scene. Its keyframes go: `world.Start` has kept the one that counts."""
    for one in list(spec.keys):
        spec.delete(one)
    world.shift(spec, file.position, file.mjcf)


def one_line(error: Exception) -> str:
    """The text of an error of MuJoCo."""
    return ", ".join(line.strip().removeprefix("Error: ") for line in str(error).splitlines() if line.strip())


def _check_numbers(path: object) -> None:
    """MuJoCo takes a nan in a file for a value that is not given, with a warning."""
    from bodies.messages import heard

    if any("'NaN'" in text for text in heard()):
        raise SceneError("holds the value nan, which MuJoCo takes for none", file=path, fix="give numbers")


def _check_gravity(option: mujoco.MjOption, gravity: float, path: object) -> None:
    wanted = (0.0, 0.0, -gravity)
    if option.disableflags & OFF.mjDSBL_GRAVITY:
        if gravity:
            fault = f"flag gravity is disabled where the scene has {gravity:g} m/s2: the bodies would have no weight"
            raise SceneError(fault, key="option", file=path, fix="enable it, or set the scene's gravity to 0")
        return
    if not np.allclose(option.gravity, wanted, rtol=1e-6, atol=1e-9):
        given = " ".join(f"{value:g}" for value in option.gravity)
        fault, fix = f"gravity is {given} m/s2 where the scene has 0 0 {-gravity:g}", "make them the same"
        raise SceneError(fault, key="option", file=path, fix=fix)


def _flags(option: mujoco.MjOption, file: str) -> list[str]:
    notes = [
        f"{file}: flag {name} is disabled: {without}"
        for bit, (name, without) in SWITCHED_OFF.items()
        if option.disableflags & bit
    ]
    for bit, name in NOT_HERE.items():
        if option.enableflags & bit:
            option.enableflags &= ~int(bit)
            notes.append(f"{file}: flag {name} has no effect: the bodies are stepped with the fluid")
    return notes


def _name(spec: mujoco.MjSpec) -> None:
    """A name for each element without one: its kind and number, and a further number where that is taken."""
    kinds = (("body", spec.bodies), ("geom", spec.geoms), ("joint", spec.joints), ("actuator", spec.actuators))
    for kind, elements in kinds:
        taken = Counter(element.name for element in elements)
        for number, element in enumerate(elements):
            if element.name:
                continue
            name, again = f"{kind}{number}", 1
            while name in taken:
                name, again = f"{kind}{number}_{again}", again + 1
            element.name = name
            taken[name] += 1
