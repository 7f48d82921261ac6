"""Water at rest over a bed that is not a box: a step, a slope, a sharp valley. Exact: hydrostatics, as in a box."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cases.validation.case import Case
from cases.validation.still_water import DEPTH, FINE_2D, REFERENCE, TARGET_2D, Stillness

Profile = list[tuple[float, float]]


def write_bed(profile: Profile, file: Path) -> None:
    """A closed mesh of the ground under a profile of points (x, z) [m] from left to right, 1 m thick and 1 m to either
    side of y = 0. Its ends are fans around the middle of the bottom, from where every point of the profile is seen."""
    import trimesh

    (left, _), (right, _) = profile[0], profile[-1]
    bottom = -DEPTH - 1.0
    outline = [(0.5 * (left + right), bottom), (left, bottom), *profile, (right, bottom)]
    n = len(outline)
    vertices = [(x, y, z) for y in (-1.0, 1.0) for x, z in outline]
    ring = [(i, (i + 1) % n) for i in range(n)]
    sides = [(i, n + i, j) for i, j in ring] + [(j, n + i, n + j) for i, j in ring]
    ends = [(0, i, j) for i, j in ring[1:-1]] + [(n, n + j, n + i) for i, j in ring[1:-1]]
    mesh = trimesh.Trimesh(np.array(vertices), np.array(sides + ends), process=False)
    if mesh.volume < 0:
        mesh.invert()
    mesh.export(file)


def bed_scene(profile: Profile):
    """Scene builder for a tank 1 m long whose bed is this profile; under the tank's walls the bed is at its lowest, so
    that ground and walls do not overlap."""

    def scene(spacing: float, folder: Path) -> dict:
        write_bed([(-0.2, -DEPTH), *profile, (1.2, -DEPTH)], folder / "bed.stl")
        tank = {"min": [0.0, -DEPTH], "max": [1.0, 0.2], "walls": ["x-", "x+"], "bathymetry": str(folder / "bed.stl")}
        return {"duration": 5.0, "tank": tank}

    return scene


def _case(name: str, title: str, profile: Profile) -> Case:
    return Case(name, title, REFERENCE, FINE_2D, bed_scene(profile), Stillness, TARGET_2D)


CASES = {
    case.name: case
    for case in (
        _case(
            "still_step",
            "Water at rest for 5 s over a step 0.3 m long and 0.2 m high",
            [(0.4, -DEPTH), (0.4, -0.3), (0.7, -0.3), (0.7, -DEPTH)],
        ),
        _case(
            "still_slope",
            "Water at rest for 5 s over a bed that rises by 0.25 m along the tank",
            [(0.0, -DEPTH), (1.0, -0.25), (1.0, -DEPTH)],
        ),
        _case(
            "still_corner",
            "Water at rest for 5 s in a valley with a corner of 103 degrees",
            [(0.0, -DEPTH), (0.0, -0.1), (0.5, -DEPTH), (1.0, -0.1), (1.0, -DEPTH)],
        ),
    )
}
