"""The stability map of the fluid: the largest stable time step beside the one that the rule takes, for weights and number of
the pressure sweeps, depth and viscosity.

Water sloshes in a square tank, from a flat surface with the velocities of the lowest mode at a height of a fifth of the
depth, for two periods and more. A fixed step is stable where no particle is lost and the kinetic energy never exceeds
twice the start's, which is all the energy of the wave. The largest stable step is found by bisection of its logarithm,
from the rule's own to 16 of them. The depth is halved and doubled at the same spacing; the viscosity is explicit and
limits the rule's step to a half. The error is the share of the largest stable step that the rule takes.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Sequence

import numpy as np

from cases.validation.engine.case import Case, Row, met
from cases.validation.engine.solvers import SOLVERS
from fsi.errors import RunError
from fsi.extras import require
from fsi.fluid.rheology import explicit_limit
from fsi.fluid.timestep import TimeStep
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

G, DEPTH, HEIGHT = 9.81, 0.5, 0.2  # [m/s2], [m], of the wave [depth]
DURATION = 8.0  # [sqrt(depth / g)]; a period is 3.55
MOST = 16.0  # largest step tried [the rule's]
BISECTIONS = 5  # the answer is known to MOST^(1 / 32), 9 %
GAIN = 2.0  # of kinetic energy, from which on a run counts as unstable
FLOWS = {"half_depth": (0.5, False), "depth": (1.0, False), "double_depth": (2.0, False), "viscous": (1.0, True)}


def tank(spacing: float, factor: float, solver: str, viscous: bool) -> Scene:
    """Water of `factor` DEPTH in a square tank; where it is viscous the explicit limit is half of the other limits."""

    def scene(nu: float) -> Scene:
        fluid = {"kinematic_viscosity": nu}
        numerics = {"viscous_step": "explicit"} | SOLVERS[solver]
        box = {"min": [0.0, -depth], "max": [depth, depth]}
        facts = {"spacing": spacing, "duration": DURATION * math.sqrt(depth / G), "tank": box}
        return Scene.model_validate(facts | {"fluid": fluid, "numerics": numerics})

    depth = factor * DEPTH
    plain = scene(1e-6)
    return scene(1e-6 * 2 * explicit_limit(plain) / rule(plain)) if viscous else plain


def rule(scene: Scene) -> float:
    """The time step [s] that the rule takes for water at rest."""
    return min(TimeStep(scene, -scene.tank.min[-1]).limits(0.0, scene.gravity).values())


class Trial:
    """One run at a fixed step, and what it cost."""

    def __init__(self, scene: Scene, step: float):
        numerics = scene.numerics.model_copy(update={"fixed_time_step": step})
        self.sim = sim = Simulation(scene.model_copy(update={"numerics": numerics}), threads=1)
        slosh(sim)
        most = GAIN * sim.balance.mass * float((sim.fluid.velocity**2).sum()) / 2
        self.stable, start = True, clock.perf_counter()

        def watch(sim: Simulation) -> None:
            if sim.fluid.lost or sim.balance.kinetic > most:
                raise RunError("unstable")

        try:
            sim.run(on_step=watch)
        except RunError:
            self.stable = False
        self.seconds = clock.perf_counter() - start


def slosh(sim: Simulation) -> None:
    """Velocities of the lowest mode of the tank, by linear theory."""
    depth = -sim.scene.tank.min[-1]
    k = math.pi / depth
    x, z = sim.fluid.position.T
    speed = 0.5 * HEIGHT * depth * math.sqrt(G * k * math.tanh(k * depth)) / math.sinh(k * depth)
    sim.fluid.velocity[:, 0] = -speed * np.cosh(k * (z + depth)) * np.sin(k * x)
    sim.fluid.velocity[:, 1] = speed * np.sinh(k * (z + depth)) * np.cos(k * x)


def largest_stable(scene: Scene) -> tuple[float, list[Trial]]:
    """The largest stable step as a multiple of the rule's, 0 where that itself is unstable, and the runs it took."""
    step = rule(scene)
    trials = [Trial(scene, step)]
    if not trials[0].stable:
        return 0.0, trials
    low, high = 0.0, math.log(MOST)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        trials.append(Trial(scene, step * math.exp(middle)))
        low, high = (middle, high) if trials[-1].stable else (low, middle)
    return math.exp(low), trials


def run(case: Case, level: str, solver: str, *_) -> tuple[Row, str]:
    """The row of one solver over all depths and viscosities; its time step is the largest stable one of water of DEPTH."""
    spacing, error, trials, step = case.spacing[level], {}, [], 0.0
    for name, (factor, viscous) in FLOWS.items():
        scene = tank(spacing, factor, solver, viscous)
        multiple, tried = largest_stable(scene)
        trials += tried
        error[f"step_share_{name}"] = 1 / multiple if multiple else None
        if name == "depth":
            step = multiple * rule(scene)
    row = Row(
        case=case.name, level=level, solver=solver, spacing=spacing, dimension=2,
        particles=max(t.sim.fluid.count for t in trials), steps=sum(t.sim.step_count for t in trials),
        particle_steps=sum(t.sim.step_count * t.sim.fluid.count for t in trials), time_step=step,
        wall_seconds=sum(t.seconds for t in trials), simulated_seconds=sum(t.sim.time for t in trials),
        memory_bytes=max(t.sim.memory_bytes for t in trials), error=error, target=dict(case.target),
        passed=all(met(error[name], target) for name, target in case.target.items()),
    )  # fmt: skip
    return row, ""


def picture(case: Case, rows: Sequence[Row]):
    """The largest stable step over the rule's: a bar for each solver at each depth and viscosity."""
    require("matplotlib", "report", "the plots of fsi validate")
    from matplotlib.figure import Figure

    rows = [row for row in rows if row.level == rows[0].level]
    figure = Figure(figsize=(8, 3.6), layout="constrained")
    panel = figure.subplots()
    wide = 0.8 / len(rows)
    for n, row in enumerate(rows):
        height = [1 / row.error[f"step_share_{name}"] if row.error[f"step_share_{name}"] else 0.0 for name in FLOWS]
        panel.bar(np.arange(len(FLOWS)) + (n - 0.5 * (len(rows) - 1)) * wide, height, wide, label=row.solver)
    panel.axhline(1.0, color="0.3", linestyle="--", label="the rule's step")
    panel.set_xticks(range(len(FLOWS)), [name.replace("_", " ") for name in FLOWS])
    panel.set_yscale("log", base=2)
    panel.set_ylabel("largest stable step [rule's]")
    figure.legend(fontsize="small", loc="outside right center")
    figure.suptitle(f"{case.name}: {case.title}", fontsize="medium")
    return figure


NAMES = ("stability",)
CASES = {
    "stability": Case(
        "stability",
        "Share of the largest stable time step that the rule takes, for sloshing water",
        "Stable: no particle lost, kinetic energy below twice the start's, over two periods. Depths"
        " of 0.25, 0.5 and 1 m; viscous: explicit, its limit half of the others.",
        {"coarse": DEPTH / 20, "medium": DEPTH / 40, "paper": DEPTH / 80},
        lambda spacing, folder: {},
        None,
        {f"step_share_{name}": 0.8 for name in FLOWS},
        run=run,
        plot=picture,
    )
}
