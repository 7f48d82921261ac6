"""A tsunami runs on to a coastal plant: bed, sea wall with two intakes, six buildings and two tanks, all made here.

After Sampath et al. (2016, J. Ocean Eng. Mar. Energy 2, 313-329, section 9), whose plant is not public: a paddle 800 m off
shore makes a solitary wave about as high as theirs, 25 m; 90 s. There is no experiment. What can be told is compared with
long-wave theory on the bed used here: the crest passes the gauge 700 m off shore and travels at sqrt(g (d + H)) over the flat
bed. Depths before the buildings, the force on each, when the water reaches the sea wall, and how far out to sea what the coast
sends back has come, are printed at the end.

`python -m cases.validation.waves.tsunami_plant FILE.stl` writes the bed and the plant.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure, Wrong
from cases.validation.waves.ground import grid
from fsi.fluid.gauges import Surface
from fsi.simulation.loop import Simulation
from fsi.waves.kinds.solitary import SolitaryPiston

G, DEPTH, HEIGHT = 9.81, 40.0, 24.0  # of the sea at the paddle and of the wave [m]
LENGTH, WIDTH, TOP = 1304.0, 1152.0, 120.0  # multiples of the spacings
FLAT, SHORE, GROUND = 300.0, 800.0, 10.0  # end of the flat bed, shore line, height of the plant's ground [m]
PROFILE = np.array([(-200, -DEPTH), (FLAT, -DEPTH), (SHORE, 0.0), (860, GROUND), (1500, GROUND)])  # x, z of the bed
WALL = (856.0, 872.0, 16.0)  # x from, to, and top of the sea wall
INTAKES = (400.0, 752.0)  # y of the middles of its gaps, 32 m wide
BUILDINGS = {  # x, y, and size along x and y of each, and its top [m]
    "reactor_1": (960, 304, 48, 48, 56),
    "reactor_2": (960, 464, 48, 48, 56),
    "reactor_3": (960, 624, 48, 48, 56),
    "reactor_4": (960, 784, 48, 48, 56),
    "turbines": (896, 544, 32, 320, 34),
    "offices": (1080, 544, 40, 160, 30),
}
TANKS = {"tank_1": (944, 928, 24, 30), "tank_2": (1008, 928, 24, 30)}  # x, y, radius, top [m]
OFFSHORE = SHORE - 700.0  # x of the gauge
SPEED = math.sqrt(G * (DEPTH + HEIGHT))
RISE = 0.1 * HEIGHT  # from which on a front counts as there [m]


def shells() -> list[tuple[np.ndarray, np.ndarray]]:
    """Closed shells (vertices, triangles) of the bed and of all that stands on it; they reach into the bed."""
    y = np.array([-100.0, WIDTH + 100.0])
    parts = [grid(PROFILE[:, 0], y, np.repeat(PROFILE[:, 1:], 2, axis=1), -DEPTH - 60.0)]
    ends = [-100.0, *(edge for middle in INTAKES for edge in (middle - 16, middle + 16)), WIDTH + 100.0]
    parts += [_box(WALL[0], WALL[1], a, b, WALL[2]) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    parts += [_box(x - a / 2, x + a / 2, y - b / 2, y + b / 2, top) for x, y, a, b, top in BUILDINGS.values()]
    for x, y, radius, top in TANKS.values():
        turn = np.linspace(0, math.tau, 24, endpoint=False)
        parts.append(_prism(np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]), top))
    return parts


def _box(x0: float, x1: float, y0: float, y1: float, top: float) -> tuple[np.ndarray, np.ndarray]:
    return _prism(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float), top)


def _prism(foot: np.ndarray, top: float, floor: float = -20.0) -> tuple[np.ndarray, np.ndarray]:
    """A prism over a convex polygon (n, 2), anticlockwise."""
    n = len(foot)
    vertices = np.concatenate([np.column_stack([foot, np.full(n, z)]) for z in (floor, top)])
    a, b = np.arange(n), np.roll(np.arange(n), -1)
    fan = np.stack([np.zeros(n - 2, int), a[1:-1], a[2:]], -1)
    sides = np.concatenate([np.stack([a, b, b + n], -1), np.stack([a, b + n, a + n], -1)])
    return vertices, np.concatenate([fan[:, ::-1], fan + n, sides])


def write(file: Path) -> None:
    """The bed and the plant as one STL file [m]."""
    import trimesh

    trimesh.util.concatenate([trimesh.Trimesh(*shell) for shell in shells()]).export(file)


class RunIn(Measure):
    """Elevation off shore and along the middle, depth before each building, and the force on it."""

    interval = 0.5

    def begin(self, sim: Simulation) -> None:
        self.rows, self._surface = [], Surface(sim.fluid)
        self._x = np.arange(OFFSHORE, 1200.0, 50.0)
        self._lines = (544.0, INTAKES[0])

    def sample(self, sim: Simulation) -> None:
        fluid, dr = sim.fluid, sim.scene.spacing
        along = [[self._surface((x, y)) for x in self._x] for y in self._lines]
        depth, force = {}, {}
        for name, (x, y, a, b, _) in BUILDINGS.items():
            depth[name] = self._surface((x - a / 2 - 1.5 * dr, y)) - GROUND
            place = fluid.solids.position[: fluid.solids.count]
            held = (np.abs(place[:, 0] - x) < a / 2) & (np.abs(place[:, 1] - y) < b / 2) & (place[:, 2] > GROUND)
            fluid.solids.count_only(held)
            force[name] = float(fluid.wrench(walls=True)[0, 0])
        fluid.solids.count_only(np.ones(fluid.solids.count, bool))
        front = float(fluid.position[fluid.position[:, 2] > 0.5 * dr, 0].max(initial=0.0))
        self.rows.append({"time": sim.time, "along": along, "depth": depth, "force": force, "front": front})

    def crest(self) -> tuple[float, float, float]:
        """Time [s] and height [m] of the crest at the gauge, and its speed from there to the end of the flat bed [m/s]."""
        t, level = self._series()
        end = int(np.argmin(np.abs(self._x - (FLAT - 50.0))))
        early = t < 45.0
        there, after = (int(np.argmax(np.where(early, level[:, 0, n], -math.inf))) for n in (0, end))
        pace = (self._x[end] - self._x[0]) / (t[after] - t[there]) if t[after] > t[there] else math.nan
        return t[there], float(level[there, 0, 0]), pace

    def loads(self) -> dict[str, tuple[float, float]]:
        """Largest depth of the water before each building [m], and largest force on it along x [N]."""
        deepest = {n: np.nanmax([*(row["depth"][n] for row in self.rows), 0.0]) for n in BUILDINGS}
        return {name: (float(deepest[name]), max(row["force"][name] for row in self.rows)) for name in BUILDINGS}

    def _series(self) -> tuple[np.ndarray, np.ndarray]:
        level = np.array([row["along"] for row in self.rows])
        return np.array([row["time"] for row in self.rows]), np.nan_to_num(level, nan=-math.inf)

    def run_in(self) -> tuple[float, float]:
        """Time [s] at which the foremost water reaches the sea wall, and its speed over the last 50 m before it [m/s]."""
        t, front = (np.array([row[key] for row in self.rows]) for key in ("time", "front"))
        most = np.maximum.accumulate(front)
        before, reached = np.interp([WALL[0] - 50, WALL[0] - 4], most, t, right=math.nan)
        return float(reached), float(46.0 / (reached - before)) if reached > before else math.nan

    def reflection(self) -> tuple[float, float, float]:
        """Of the wave that the coast sends back, in the middle: how far off shore its front is at the end [m], its speed over
        the last 300 m [m/s], and the largest rise at a place there [m]; nan where none has set out.

        Its front is at a place when the water has risen there by `RISE` from its lowest level after the crest that ran in; it
        comes later from place to place, out to sea."""
        t, level = self._series()
        reached, _ = self.run_in()
        places, times, rises = [], [], []
        for n in np.flatnonzero(self._x < SHORE)[::-1]:
            y = level[:, 0, n]
            after = int(np.argmax(np.where(t < reached, y, -math.inf)))
            rest = np.where(np.isfinite(y), y, math.nan)[after:]  # dry: no surface, and no front
            rise = rest - np.fmin.accumulate(rest)
            there = rise > RISE
            when = t[after + there.argmax()] if there.any() else math.nan
            if not when > (times[-1] if times else reached):
                break
            places, times, rises = [*places, self._x[n]], [*times, when], [*rises, np.nanmax(rise)]
        if len(places) < 7:
            return math.nan, math.nan, math.nan
        return float(SHORE - places[-1]), -float(np.polyfit(times[-7:], places[-7:], 1)[0]), float(max(rises[-7:]))

    def errors(self) -> dict[str, float]:
        time, height, pace = self.crest()
        piston = SolitaryPiston(HEIGHT, DEPTH, G)
        expected = 0.5 * piston.time + (OFFSHORE - 0.5 * piston.stroke) / SPEED  # the crest leaves it half way
        reached, speed = self.run_in()
        told = {"crest": (time, height, pace), "sea_wall": (reached, speed), "reflection": self.reflection()}
        told["loads"] = self.loads()
        print(json.dumps(told), file=sys.stderr)
        return {"crest_height": height / HEIGHT - 1, "crest_speed": pace / SPEED - 1, "crest_time_s": time - expected}


def scene(spacing: float, folder: Path) -> dict:
    write(folder / "plant.stl")
    return {
        "dimension": 3,
        "duration": 90.0,
        "tank": {
            "min": [0.0, 0.0, -DEPTH],
            "max": [LENGTH, WIDTH, TOP],
            "walls": ["x-", "y-", "y+"],
            "open": ["x+", "z+"],
            "bathymetry": str(folder / "plant.stl"),
        },
        "waves": {"kind": "solitary", "wave_height": HEIGHT},
        "numerics": {"solver": "iisph"},
    }


NAMES = ("tsunami_plant",)
CASES = {
    "tsunami_plant": Case(
        "tsunami_plant",
        "A tsunami runs on to a coastal plant",
        "Long-wave theory over the flat bed: the wave's height, its speed sqrt(g (d + H)), and when its crest is 700 m off"
        " shore. Depths and forces at the buildings have no reference (the source's plant is not public).",
        {"coarse": 8.0, "medium": 4.0, "paper": 2.0},
        scene,
        RunIn,
        {"crest_height": 0.2, "crest_speed": 0.1, "crest_time_s": 1.0},
        fails_when={
            "crest_height": Wrong("half of it is lost", 0.5),
            "crest_speed": Wrong("sqrt(g d), without the wave's own height", 1 - math.sqrt(DEPTH / (DEPTH + HEIGHT))),
            "crest_time_s": Wrong(
                "a wave that starts with the paddle's end", SolitaryPiston(HEIGHT, DEPTH, G).time / 2
            ),
        },
    )
}

if __name__ == "__main__":
    write(Path(sys.argv[1]))
