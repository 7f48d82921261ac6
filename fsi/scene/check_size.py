"""Sizes of a scene before anything is allocated: particles, cells, steps; refused by number and key where they do not fit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsi.compute.memory import free_memory
from fsi.compute.team import available_threads
from fsi.scene.model import Scene
from fsi.waves.kind import Fault

BYTES_PER_PARTICLE = 400  # single-precision sweeps, viscous; measured
DOUBLE = 1.6  # of it in double-precision sweeps
ACROSS = {2: 3.6, 3: 2.1}  # width of a cell of the search [spacing], a spacing long (`fsi.particles.cells`)
FEW_CELLS, EMPTY = 2.5e5, 16.0  # cells, and cells a particle, up to which empty ones are kept (`fsi.particles.cells`)
MOST_PARTICLES = 2**31 - 1  # they are counted in 32 bits
LONGEST_SIDE = (
    1e5  # spacings; places relative to the tank's corner, in single precision, are then right to 0.6 % of a spacing
)
MOST_STEPS = 1e9  # at a millisecond a step, eleven days
LONGEST_STEP = 4.0  # smoothing lengths that long waves travel in a step at Mach number 1, at most


def size_faults(scene: Scene, volume: float, depth: float) -> Iterator[Fault]:
    """What does not fit into the memory that is free, and runs of too many steps, for a fluid of this volume [m3, in two
    dimensions m2] and depth [m]."""
    fluid, walls = fluid_particles(scene, volume), wall_particles(scene)
    cells = min(grid_cells(scene), max(FEW_CELLS, EMPTY * (fluid + walls)))
    longest = max(high - low for low, high in zip(scene.tank.min, scene.tank.max, strict=True)) / scene.spacing
    each = BYTES_PER_PARTICLE * (DOUBLE if scene.numerics.precision == "double" else 1.0)
    have, grid = free_memory(), 8.0 * (available_threads() + 1) * cells  # a count a thread and a start, in two sorts
    if fluid * each > have or fluid > MOST_PARTICLES:
        need = fluid * each
        fault = f"{scene.spacing:g} m gives {fluid:.3g} fluid particles, {_of(need, have)}"
        least = scene.spacing * max(need / have, fluid / MOST_PARTICLES) ** (1 / scene.dimension)
        yield "spacing", fault, f"use more than {least:.2g} m or a smaller tank"
    elif (fluid + walls) * each > have or walls > MOST_PARTICLES:
        fault = f"its walls take {walls:.3g} particles of {scene.spacing:g} m, {_of((fluid + walls) * each, have)}"
        yield "tank", fault, "use a smaller tank, fewer walls or a larger spacing"
    elif (fluid + walls) * each + grid > have:
        fault = f"takes {cells:.3g} cells for the search of neighbours, {_of((fluid + walls) * each + grid, have)}"
        yield "tank", fault, "use a tank that is no larger than the fluid needs, or a larger spacing"
    elif longest > LONGEST_SIDE:
        fault = f"is {longest:.3g} spacings long; places are resolved up to {LONGEST_SIDE:.0e}"
        yield "tank", fault, "use a tank that is no larger than the fluid needs, or a larger spacing"
    steps, key = fewest_steps(scene, depth)
    if steps > MOST_STEPS:
        step = scene.duration / steps
        fault = f"{scene.duration:g} s at steps of at most {step:.3g} s are {steps:.3g} steps or more"
        yield key, fault, f"at most {MOST_STEPS:.0e} are allowed; use a shorter duration or longer steps"


def fluid_particles(scene: Scene, volume: float) -> float:
    """Of a fluid of this volume [m3, in two dimensions m2]."""
    with np.errstate(over="ignore"):  # infinitely many are too many
        for _ in range(scene.dimension):  # one by one: a small spacing's power is zero
            volume /= scene.spacing
    return volume


def wall_particles(scene: Scene) -> float:
    """Boundary particles of the tank's walls."""
    dr, tank = scene.spacing, scene.tank
    sides = [(high - low) / dr for low, high in zip(tank.min, tank.max, strict=True)]
    wide = [side + 2 * scene.layers for side in sides]
    total = 0.0
    for d, name in enumerate(tank.axes):
        count = sum(side in tank.walls for side in (f"{name}-", f"{name}+")) if name not in tank.periodic else 0
        others = [wide[e] if e < d else sides[e] for e in range(len(sides)) if e != d]
        total += count * scene.layers * math.prod(others)
    return total


def grid_cells(scene: Scene) -> float:
    """Cells of the search of neighbours, over the tank and its walls."""
    margin = 2 * (scene.layers + 2 * scene.numerics.smoothing_ratio + 4)
    sides = list(zip(scene.tank.min, scene.tank.max, [1.0, *[ACROSS[scene.dimension]] * (scene.dimension - 1)], strict=True))
    return math.prod(((high - low) / scene.spacing + margin) / cell for low, high, cell in sides)


def fewest_steps(scene: Scene, depth: float) -> tuple[float, str]:
    """Steps of a run at least, and the key that makes them so many."""
    numerics = scene.numerics
    steps = {key: getattr(numerics, key) or math.inf for key in ("fixed_time_step", "max_time_step")}
    if numerics.fixed_time_step is None and scene.gravity > 0 and depth > 0:
        longest = LONGEST_STEP * scene.smoothing_length * numerics.mach
        speed = math.sqrt(scene.gravity) * math.sqrt(depth)
        steps["duration"] = longest / speed
        if numerics.solver == "iisph":
            steps["duration"] = numerics.lambda_max * math.sqrt(2 * scene.smoothing_length / scene.gravity)
    key = min(steps, key=steps.get)
    step = steps[key]
    counted = scene.duration / step if step > 0 else math.inf
    return counted, key if key == "duration" else f"numerics.{key}"


def _of(need: float, have: float) -> str:
    return f"{need / 1e9:.3g} GB of {have / 1e9:.3g} GB that are free"
