"""The time series of a run: the one table that the log, the timeline, the dataset and the documentation share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsi.protocols import BodySet
from fsi.scene.model import Scene


@dataclass(frozen=True)
class Series:
    """One series: `dims` beside time, `units` (`rotary_units` for a hinge, where they differ) and a long name."""

    dims: tuple[str, ...]
    units: str
    long_name: str
    rotary_units: str = ""


SERIES = {
    "body_position": Series(("body", "axis"), "m", "position of the centre of mass"),
    "body_quaternion": Series(("body", "wxyz"), "1", "orientation, body to world"),
    "body_velocity": Series(("body", "axis"), "m/s", "velocity of the centre of mass"),
    "body_angular_velocity": Series(("body", "axis"), "rad/s", "angular velocity, world frame"),
    "body_force": Series(("body", "axis"), "N", "force of the fluid on the body, world frame"),
    "body_torque": Series(("body", "axis"), "N m", "torque of the fluid about the centre of mass, world frame"),
    "dry_position": Series(("dry_body", "axis"), "m", "position of the centre of mass, bodies outside the fluid"),
    "dry_quaternion": Series(("dry_body", "wxyz"), "1", "orientation, body to world, bodies outside the fluid"),
    "joint_position": Series(("joint",), "m", "joint position", "rad"),
    "joint_velocity": Series(("joint",), "m/s", "joint velocity", "rad/s"),
    "joint_force": Series(("joint",), "N", "force of spring, damper, actuators and power take-off on the joint", "N m"),
    "pto_power": Series(("joint",), "W", "power that damper, actuators and power take-off absorb"),
    "sensor_reading": Series(("sensor",), "SI", "sensors of the body files, in the units and frames of MuJoCo"),
    "control": Series(("actuator",), "SI", "control of the actuators, in the units of the body files"),
    "actuator_force": Series(("actuator",), "SI", "force of the actuators, N or N m by what they act on"),
    "mooring_tension": Series(("mooring",), "N", "tension of the mooring line at its fairlead"),
    "elevation": Series(("gauge",), "m", "free surface above still water"),
    "pressure": Series(("probe",), "Pa", "pressure"),
    "velocity": Series(("velocimeter", "axis"), "m/s", "velocity of the fluid"),
    "layer_thickness": Series(("depth",), "m", "thickness of the layer of fluid"),
    "runup_distance": Series(("runup",), "m", "distance of the water line along its line"),
    "runup_height": Series(("runup",), "m", "run-up, height of the water line above still water"),
    "wet_area": Series(("area",), "m2", "flooded area"),
    "inundation_depth": Series(("area",), "m", "mean depth on the flooded area"),
    "discharge": Series(("flux",), "m3/s", "discharge through the plane"),
    "passed_volume": Series(("flux",), "m3", "volume that has passed the plane since the start"),
    "load_force": Series(("structure", "axis"), "N", "force of the fluid on the fixed structure"),
    "load_torque": Series(("structure", "axis"), "N m", "torque of the fluid on the fixed structure"),
    "load_centre": Series(("structure", "axis"), "m", "pressure centre on the fixed structure"),
    "kinetic_energy": Series((), "J", "kinetic energy of the fluid"),
    "potential_energy": Series((), "J", "potential energy of the fluid"),
    "dissipated_energy": Series((), "J", "energy dissipated in the fluid since the start"),
    "body_work": Series((), "J", "work of the fluid on the bodies since the start"),
    "wavemaker_work": Series((), "J", "work of the wavemaker on the fluid since the start"),
    "time_step": Series((), "s", "time step"),
    "max_speed": Series((), "m/s", "largest particle speed"),
    "volume": Series((), "m3", "volume of the fluid"),
    "lost_particles": Series((), "1", "particles that left the tank"),
    "pressure_residual": Series((), "1", "residual of the pressure equation, relative"),
}


def describe(name: str, shape: tuple[int, ...], rotary: tuple[bool, ...] = ()) -> Series:
    """What is known of a series of this shape; one that is not in the table gets dimensions of its own.

    `rotary` says of every joint whether it is a hinge; hinges and slides together read e.g. `m or rad`.
    """
    known = SERIES.get(name)
    if known is None or len(known.dims) != len(shape):
        dims = tuple(f"{name}_{n}" for n in range(len(shape)))
        return Series(dims, known.units if known else "", known.long_name if known else name.replace("_", " "))
    if not known.rotary_units or not any(rotary):
        return known
    units = known.rotary_units if all(rotary) else f"{known.units} or {known.rotary_units}"
    return Series(known.dims, units, known.long_name)


def labels(scene: Scene, bodies: BodySet | None) -> dict[str, list[str]]:
    """Dimension -> names along it."""
    return {
        "axis": ["x", "y", "z"],
        "wxyz": ["w", "x", "y", "z"],
        "body": list(bodies.names) if bodies else [],
        "dry_body": list(bodies.dry_names) if bodies else [],
        "joint": list(bodies.joint_names) if bodies else [],
        "sensor": list(bodies.sensor_names) if bodies else [],
        "actuator": list(getattr(bodies, "actuator_names", ())),
        "mooring": list(getattr(bodies, "mooring_names", ())),
        "gauge": list(scene.gauges),
        "probe": list(scene.probes),
        "velocimeter": velocimeter_names(scene),
        "depth": list(scene.depths),
        "runup": list(scene.runups),
        "area": list(scene.areas),
        "flux": list(scene.fluxes),
        "structure": list(scene.loads),
    }


def velocimeter_names(scene: Scene) -> list[str]:
    """One name for every point that a velocimeter reads: `adv`, or `adv[0]`, `adv[1]`, ... along a profile."""
    return [
        name if meter.end is None else f"{name}[{n}]"
        for name, meter in scene.velocimeters.items()
        for n in range(len(meter.places))
    ]


def column_names(series: Series, shape: tuple[int, ...], along: dict[str, list[str]]) -> list[str]:
    """One name for every element of a series, in C order: `flap.x`, `flap.y`, ...; `[""]` for a scalar."""
    names = [along.get(dim) or [str(n) for n in range(size)] for dim, size in zip(series.dims, shape, strict=True)]
    return [".".join(ns[i] for ns, i in zip(names, index, strict=True)) for index in np.ndindex(shape)]
