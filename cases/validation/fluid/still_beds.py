"""Water at rest over solids that touch and overlap the walls of the tank and each other: slabs on, under and above the floor
at every offset of their lattices, narrower and wider than the tank, a wavy bed cut at the floor, a cliff, shores
and an islet, fixed geoms that stand on the bed and go through a wall.

Exact: hydrostatics. After 2 s: `largest_speed` over the particles as a share of sqrt(g H); `pressure_l2` against rho g depth
under the level that the water has, two spacings under the surface and deeper, as a share of rho g H; `leaks`, lost particles.
`python -m cases.validation.fluid.still_beds [PATTERN ...]` runs them all and prints a table.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure
from cases.validation.engine.wrong import Wrong

DEPTH, LENGTH, WIDTH, SPACING = 0.5, 0.6, 0.32, 0.02  # [m]
TARGET = {"largest_speed": 0.02, "pressure_l2": 0.01, "leaks": 0.0}
WRONG = {
    "largest_speed": Wrong("water that does not come to rest, at 0.2 m/s", 0.2 / math.sqrt(9.81 * DEPTH)),
    "pressure_l2": Wrong("half a spacing of water too much", 0.5 * SPACING / DEPTH),
}
Outline = list[tuple[float, float]]


class Rest(Measure):
    """What is wrong with water at rest at the end of the run. `walls`: x [m] of solids that divide it into pools."""

    def __init__(self, sim, walls: tuple[float, ...] = ()):
        self.walls = np.array(walls)
        super().__init__(sim)

    def begin(self, sim) -> None:
        self.sim = sim

    def errors(self) -> dict[str, float]:
        fluid, scene = self.sim.fluid, self.sim.scene
        height = scene.fluid.still_water_level - scene.tank.min[-1]
        speed = math.sqrt((fluid.velocity**2).sum(1).max(initial=0.0) / (scene.gravity * height))
        z, scale = fluid.position[:, -1], scene.fluid.density * scene.gravity
        deep = z < scene.fluid.still_water_level - 2 * scene.spacing
        level = z[deep] + fluid.pressure_values[deep] / scale
        pool = np.searchsorted(self.walls, fluid.position[deep, 0])
        mean = np.bincount(pool, level) / np.maximum(np.bincount(pool), 1)
        spread = math.sqrt(((level - mean[pool]) ** 2).mean()) / height
        return {"largest_speed": speed, "pressure_l2": spread, "leaks": float(fluid.lost)}


def extruded(outline: Outline, file: Path, half: float = 1.0) -> None:
    """A closed mesh (STL) of a polygon in (x, z), anticlockwise, from y = -half to half [m]."""
    import trimesh

    corners = np.array(outline)
    faces, n = np.array(_ears(corners)), len(corners)
    vertices = np.vstack([np.insert(corners, 1, y, axis=1) for y in (-half, half)])
    ring = [(i, (i + 1) % n) for i in range(n)]
    sides = [(i, n + i, j) for i, j in ring] + [(j, n + i, n + j) for i, j in ring]
    mesh = trimesh.Trimesh(vertices, np.vstack([faces, n + faces[:, ::-1], sides]), process=False)
    if mesh.volume < 0:
        mesh.invert()
    mesh.export(file)


def _ears(corners: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon with corners (n, 2), anticlockwise, one ear after the other."""
    rest, found = list(range(len(corners))), []

    def turn(a, b, c) -> float:
        (x, z), (u, w) = corners[b] - corners[a], corners[c] - corners[a]
        return x * w - z * u

    while len(rest) > 3:
        for k in range(len(rest)):
            a, b, c = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
            others = (p for p in rest if p not in (a, b, c))
            if turn(a, b, c) > 0 and not any(min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) >= 0 for p in others):
                break
        found.append((a, b, c))
        rest.remove(b)
    return [*found, tuple(rest)]


def box(low: float, high: float, bottom: float, top: float) -> Outline:
    """A rectangle."""
    return [(low, bottom), (high, bottom), (high, top), (low, top)]


def profile(heights: Callable[[float], float], low: float, high: float, count: int = 40) -> Outline:
    """The ground under z = heights(x), down to half a metre under the floor."""
    x = np.linspace(high, low, count)
    return [(low, -DEPTH - 0.5), (high, -DEPTH - 0.5), *((float(a), heights(float(a))) for a in x)]


def scene(spacing: float, folder: Path, *, dimension: int = 2, ground: Outline | None = None, geoms=()) -> dict:
    """A tank with the ground of this outline, and fixed boxes `geoms` as (low, high, bottom, top) [m]."""
    across = [] if dimension == 2 else [-0.5 * WIDTH], [] if dimension == 2 else [0.5 * WIDTH]
    tank: dict = {"min": [0.0, *across[0], -DEPTH], "max": [LENGTH, *across[1], 0.2]}
    parts: dict = {"dimension": dimension, "spacing": spacing, "duration": 2.0, "tank": tank}
    if ground:
        extruded(ground, folder / "bed.stl")
        tank["bathymetry"] = str(folder / "bed.stl")
    if geoms:
        half = 0.1 if dimension == 3 else 1.0
        boxes = "".join(
            f'<geom name="g{n}" type="box" pos="{(a + b) / 2} 0 {(c + d) / 2}" size="{(b - a) / 2} {half} {(d - c) / 2}"/>'
            for n, (a, b, c, d) in enumerate(geoms)
        )
        wet = "".join(f'<element objtype="geom" objname="g{n}"/>' for n in range(len(geoms)))
        text = f'<mujoco><worldbody>{boxes}</worldbody><custom><tuple name="wet">{wet}</tuple></custom></mujoco>'
        (folder / "geoms.xml").write_text(text)
        parts["bodies"] = {"fixed": {"mjcf": str(folder / "geoms.xml")}}
    return parts


def _setups() -> dict[str, dict]:
    """Name -> arguments of `scene`; offsets in spacings."""
    dr, found = SPACING, {}
    spans = {"wide": (-0.5, 1.1), "narrow": (0.2 + 0.37 * dr, 0.4 + 0.11 * dr)}
    for span, (a, b) in spans.items():
        for tenth in range(-10, 11):
            t = tenth / 10
            found[f"{span}_top{t:+.1f}"] = {"ground": box(a, b, -DEPTH - 0.3, -DEPTH + t * dr)}
        for tenth in range(11):
            bottom = -DEPTH + tenth / 10 * dr
            found[f"{span}_hover{tenth / 10:+.1f}"] = {"ground": box(a, b, bottom, bottom + 5.3 * dr)}
        for tenth in range(0, 11, 2):
            found[f"{span}_step{tenth / 10:+.1f}"] = {"ground": box(a, b, -DEPTH - 0.3, -DEPTH + (4 + tenth / 10) * dr)}
    wavy = partial(_wavy, base=-DEPTH)
    found["wavy_cut"] = {"ground": profile(wavy, -0.3, 0.9, 100)}
    found["slope_cut"] = {"ground": profile(lambda x: -DEPTH - 0.06 + 0.25 * x, -0.3, 0.9)}
    for name, base, slope in (("steep", -0.43, 0.9), ("shore", -0.11, 0.2), ("flat_shore", -0.07, 0.13)):
        found[name] = {"ground": profile(lambda x, base=base, slope=slope: base + slope * x, -0.3, 0.9)}
    found["islet"] = {"ground": profile(lambda x: max(-0.43, 0.07 - abs(x - 0.31)), -0.3, 0.9, 121)}
    found["cliff"] = {
        "ground": [(-0.3, -0.9), (0.9, -0.9), (0.9, -0.213), (0.3071, -0.213), (0.3071, -0.487), (-0.3, -0.487)]
    }
    found["pile_on_floor"] = {"geoms": [(0.2, 0.3, -DEPTH, 0.1)]}
    found["pile_in_floor"] = {"geoms": [(0.207, 0.303, -DEPTH - 0.1, 0.1)]}
    found["beam_through_wall"] = {"geoms": [(-0.2, 0.123, -0.307, -0.197)]}
    found["pile_on_bed"] = {"ground": box(-0.5, 1.1, -0.8, -0.433), "geoms": [(0.207, 0.303, -0.437, 0.1)]}
    found["pile_in_bed"] = {"ground": profile(wavy, -0.3, 0.9, 100), "geoms": [(0.207, 0.303, -0.6, 0.1)]}
    found["hung"] = {"geoms": [(0.207, 0.303, -0.3, 0.1)]}  # overlaps nothing
    found["two_piles"] = {"geoms": [(0.2, 0.31, -0.6, 0.1), (0.31, 0.42, -0.6, -0.2)]}
    solid = ("shore", "wide_top+0.0", "wide_top+0.5", "narrow_top-0.5", "narrow_step+0.4", "wavy_cut")
    for name in (*solid, "pile_in_floor", "beam_through_wall", "hung", "pile_on_floor"):
        found[f"{name}_3d"] = {"dimension": 3} | found[name]
    return found


def _wavy(x: float, base: float) -> float:
    return base + 0.03 * math.sin(11 * x + 0.4) + 0.011 * math.sin(37 * x)


def pool_walls(dimension: int = 2, geoms=(), **_) -> tuple[float, ...]:
    """Where geoms that rise out of the water divide a two-dimensional tank."""
    return tuple(sorted(0.5 * (a + b) for a, b, _, top in geoms if top > 0)) if dimension == 2 else ()


SETUPS = _setups()
REFERENCE = "Exact: hydrostatic pressure, no motion, nothing lost."
FINE = {"coarse": SPACING, "medium": SPACING / 1.6, "paper": SPACING / 2}
VALIDATED = {
    "flush": ("wide_top+0.0", "a bed that lies flush with the floor"),
    "raised": ("narrow_top+0.5", "a bed that rises out of the floor by half a spacing"),
    "gap": ("narrow_hover+0.6", "a slab 0.6 spacings above the floor"),
    "wavy": ("wavy_cut", "a wavy bed that the floor cuts"),
    "cliff": ("cliff", "a bed with a cliff, through both walls"),
    "shore": ("flat_shore", "a bed of 1 in 8 that rises out of it"),
    "pile": ("pile_in_bed", "a wavy bed with a pile that reaches into it"),
    "3d": ("wide_top+0.5_3d", "a bed half a spacing above the floor, in three dimensions"),
}
NAMES = (
    "still_bed_flush",
    "still_bed_raised",
    "still_bed_gap",
    "still_bed_wavy",
    "still_bed_cliff",
    "still_bed_shore",
    "still_bed_pile",
    "still_bed_3d",
)
CASES = {
    f"still_bed_{name}": Case(
        f"still_bed_{name}", f"Water at rest for 2 s over {what}", REFERENCE, FINE,
        partial(scene, **SETUPS[setup]), partial(Rest, walls=pool_walls(**SETUPS[setup])), TARGET,
        fails_when=WRONG,
    )
    for name, (setup, what) in VALIDATED.items()
}  # fmt: skip


def measure(name: str, folder: Path, spacing: float = SPACING, until: float = 2.0) -> dict[str, float]:
    """The errors of one setup, with files in `folder`, after `until` seconds."""
    from fsi.scene.binding import bind
    from fsi.scene.file import load_scene
    from fsi.scene.model import Scene
    from fsi.simulation.loop import Simulation

    it = load_scene(Scene.model_validate(scene(spacing, folder, **SETUPS[name])))
    bodies, coupler, ground = bind(it, name)
    sim = Simulation(it, bodies=bodies, coupler=coupler, ground=ground)
    rest = Rest(sim, pool_walls(**SETUPS[name]))
    sim.run(until)
    return rest.errors()


def main() -> None:
    patterns = sys.argv[1:] or ["*"]
    bad = 0
    print(f"{'setup':24} {'speed/sqrt(gH)':>14} {'pressure L2':>12} {'lost':>5}")
    for name in SETUPS:
        if any(fnmatchcase(name, pattern) for pattern in patterns):
            with tempfile.TemporaryDirectory() as folder:
                found = measure(name, Path(folder))
            missed = [key for key, value in found.items() if not value <= TARGET[key]]
            bad += bool(missed)
            speed, spread, lost = found.values()
            print(f"{name:24} {speed:14.4f} {spread:12.5f} {lost:5.0f} {'MISSED' if missed else ''}", flush=True)
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
