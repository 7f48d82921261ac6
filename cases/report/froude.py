"""From the tank to the sea by Froude's law: lengths by the scale, times by its root, in water of the same density (Chakrabarti
1994, Offshore Structure Modeling, section 2.3)."""

from __future__ import annotations

import math
import re

from fsi.errors import SceneError

POWERS = {  # of the scale, for each unit
    "1": 0.0, "rad": 0.0, "degrees": 0.0, "m": 1.0, "s": 0.5, "kg": 3.0, "N": 3.0, "Pa": 1.0, "W": 3.5, "J": 4.0,
    "Wh": 4.0, "Hz": -0.5, "l": 3.0,
}  # fmt: skip
OWN = ("wall_seconds", "lost_particles")  # figures of the computation


def power(units: str) -> float | None:
    """The power of the scale that a quantity in these units goes by, such as 4.5 for "N m s/rad"; None for unknown units."""
    total = 0.0
    for n, part in enumerate(units.split("/")):
        words = part.split() if n == 0 else [part.split()[0]] if part.split() else []
        if n and len(part.split()) > 1:
            return None
        for word in words:
            found = re.fullmatch(r"([A-Za-z]+|1)(-?\d+)?", word)
            if not found or found[1] not in POWERS:
                return None
            total += (1 if n == 0 else -1) * POWERS[found[1]] * int(found[2] or 1)
    return total if units else None


def check_scale(scale: float) -> float:
    """The scale, full size over model. Raises SceneError where it is none."""
    if not (math.isfinite(scale) and scale > 0):
        raise SceneError(f"is {scale:g}", key="--scale", fix="give full size over model, such as 25")
    return float(scale)


def scaled(data, scale: float):
    """The dataset of a study at full scale, and the names of what stays as it is because its units are unknown."""
    left, new = [], {}
    for name, variable in data.variables.items():
        if variable.dtype.kind not in "if" or name in OWN or name == "seed":
            continue
        n = power(variable.attrs.get("units", "1"))
        if n is None or ("key" in variable.attrs and variable.attrs.get("units", "1") == "1"):
            left.append(str(name))
        elif n:
            new[name] = variable.dims, variable.values * scale**n, variable.attrs
    coords = {name: value for name, value in new.items() if name in data.coords}
    rest = {name: value for name, value in new.items() if name not in data.coords}
    return data.assign_coords(coords).assign(rest), left
