"""Names of what the sensors of an MJCF file read."""

from __future__ import annotations

import mujoco


def names(model: mujoco.MjModel) -> tuple[str, ...]:
    """One name for each number in MuJoCo's `sensordata`: `NAME`, or `NAME.x`, `NAME.y`, `NAME.z` of a vector."""
    found = []
    for sensor in range(model.nsensor):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SENSOR, sensor) or f"sensor{sensor}"
        size = int(model.sensor_dim[sensor])
        parts = {1: [""], 3: [".x", ".y", ".z"], 4: [".w", ".x", ".y", ".z"]}.get(size)
        found += [name + part for part in parts or (f".{n}" for n in range(size))]
    return tuple(found)
