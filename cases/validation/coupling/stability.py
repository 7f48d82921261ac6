"""Where each scheme is stable: density ratio x time step x scheme, for four arrangements of bodies in a small tank, 2D.

Every body is let go off its rest and watched for a second; springs as stiff as the water's carry what its weight and
buoyancy leave over, so that heavy ones float in the same place. The release holds energy for less than half a metre per
second; a run that stops, or in which a point of a body passes `LIMIT`, is unstable.

The cases run the default scheme at its own time step for all ratios from 0.02 on. The whole map, with its table and its
picture, is made by `python -m cases.validation.coupling.stability --out DIR`.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.errors import RunError
from fsi.scene.binding import bind
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

RATIOS = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 8.0)
STEPS = (0.5, 1.0, 2.0)  # of the scheme's own time step
SCHEMES = ("lagged", "added_mass", "fixed_point")
LIMIT = 2.0  # m/s
SLOW = 0.01  # m/s; a body that never got faster has not been let go
DURATION = 1.0  # s
WATER, G, DEPTH = 1000.0, 9.81, 0.4

MODEL = """<mujoco><compiler angle="radian"/><option timestep="0.05" integrator="implicitfast"/>
  <worldbody>{bodies}</worldbody></mujoco>"""
BOX = '<geom name="{name}" type="box" pos="{x} 0 0" size="{half} 0.5 0.08" density="{density}"/>'


def _spring(axis: str, stiffness: float, force: float = 0.0, kind: str = "slide") -> str:
    """A joint with a spring that exerts `force` [N or N m] in the initial pose."""
    rest = force / stiffness
    return f'<joint type="{kind}" axis="{axis}" stiffness="{stiffness:.6g}" springref="{rest:.6g}"/>'


def _floating(name: str, half: float, density: float, joints: str, x: float = 0.0, inner: str = "") -> str:
    """A box half in the water, 2 cm above its rest."""
    geom = BOX.format(name=name, x=0, half=half, density=density)
    return f'<body name="{name}" pos="{x} 0 0.02">{joints}{geom}{inner}</body>'


def _over(half: float, density: float) -> float:
    """What weight and buoyancy of a box leave over at half immersion [N]."""
    return 2 * half * (0.16 * density - 0.08 * WATER) * G


def _heave(half: float, density: float) -> str:
    """A vertical joint that carries that, where the box rests."""
    stiffness = WATER * G * 2 * half
    return _spring("0 0 1", stiffness, _over(half, density) - 0.02 * stiffness)


def heave(density: float) -> str:
    return _floating("box", 0.16, density, _heave(0.16, density))


def free_box(density: float) -> str:
    surge, pitch = _spring("1 0 0", 200.0), _spring("0 1 0", 50.0, 2.0, "hinge")
    return _floating("box", 0.16, density, surge + _heave(0.16, density) + pitch)


def raft(density: float) -> str:
    """Two boxes joined by a hinge; the first one floats freely and carries both."""
    geom = BOX.format(name="aft", x=0.2, half=0.16, density=density)
    lever, over = 0.2, _over(0.16, density)
    hinge = _spring("0 1 0", 150.0, 2.0 - over * lever, "hinge")
    aft = f'<body name="aft" pos="0.2 0 0">{hinge}{geom}</body>'
    joints = _spring("1 0 0", 200.0) + _heave(0.32, density) + _spring("0 1 0", 300.0, -2 * over * lever, "hinge")
    return _floating("fore", 0.16, density, joints, -0.2, aft)


def flap(density: float) -> str:
    """A flap hinged near the bed, through the surface."""
    hinge = _spring("0 1 0", 1500.0, 60.0, "hinge")
    geom = f'<geom name="flap" type="box" pos="0 0 0.2" size="0.06 0.5 0.2" density="{density}"/>'
    return f'<body name="flap" pos="0 0 -0.3">{hinge}{geom}</body>'


ARRANGEMENTS = {"heave": heave, "flap": flap, "box": free_box, "raft": raft}


def scene(
    arrangement: str, ratio: float, spacing: float, folder, scheme: str = "added_mass", step: float = 1.0
) -> dict:
    """A scene of the map; `step` is the time step over the scheme's own."""
    file = Path(folder, f"{arrangement}.xml")
    file.write_text(MODEL.format(bodies=ARRANGEMENTS[arrangement](ratio * WATER)), encoding="utf-8")
    return {
        "duration": DURATION,
        "tank": {"min": [-0.8, -DEPTH], "max": [0.8, 0.4]},
        "bodies": {"set": {"mjcf": str(file)}},
        "coupler": {"scheme": scheme},
        "numerics": {"mach": min(1.0, 0.2 * step), "courant": min(1.0, 0.2 * step)},
    }


class Cell(Measure):
    """Fastest point of a body in a run; for a case, also the other ratios that the default scheme has to hold."""

    def __init__(self, sim, arrangement: str):
        self.arrangement, self.fastest = arrangement, 0.0
        super().__init__(sim)

    def begin(self, sim) -> None:
        self.spacing, self.threads = sim.scene.spacing, sim.threads

    def sample(self, sim) -> None:
        motion = sim.bodies.motion()
        spin = np.linalg.norm(motion.velocity[:, 3:], axis=1) * sim.movers.reach
        speeds = np.linalg.norm(motion.velocity[:, :3], axis=1) + spin
        self.fastest = max(self.fastest, float(speeds.max()))

    def errors(self) -> dict[str, float]:
        others = [r for r in RATIOS if r > 0.02]
        found = [run(self.arrangement, ratio, self.spacing, threads=self.threads)[0] for ratio in others]
        fastest = np.array([self.fastest, *found])
        held = fastest.max() / LIMIT if fastest.min() > SLOW else np.nan
        return {"unstable_cells": float((fastest > LIMIT).sum()), "fastest_point": held}


def run(
    arrangement: str, ratio: float, spacing: float, scheme: str = "added_mass", step: float = 1.0, threads: int = 1
) -> tuple[float, float, float]:
    """Fastest point of a body [m/s], infinite where the run stopped; pressure updates per step; largest added over own
    inertia at the start."""
    with tempfile.TemporaryDirectory() as folder:
        made = Scene.model_validate(scene(arrangement, ratio, spacing, folder, scheme, step) | {"spacing": spacing})
        bodies, coupler, ground = bind(made, arrangement)
        sim = Simulation(made, bodies=bodies, coupler=coupler, ground=ground, threads=threads)
    cell = Cell(sim, arrangement)
    sim.step()
    ratios = coupler.mass_ratio(bodies)
    try:
        sim.run(on_step=cell)
        fastest = cell.fastest
    except RunError:
        fastest = np.inf
    finally:
        sim.team.close()
    return fastest, sim.coupling()["pressure_updates"], float(np.max(ratios))


def stability_map(spacing: float, say=print) -> dict[tuple, tuple[float, float, float]]:
    """All cells: (arrangement, scheme, step, ratio) to the figures of `run`."""
    cells = {}
    for key in [(a, s, f, r) for a in ARRANGEMENTS for s in SCHEMES for f in STEPS for r in RATIOS]:
        arrangement, scheme, step, ratio = key
        cells[key] = run(arrangement, ratio, spacing, scheme, step)
        say(f"{arrangement}, {scheme}, {step:g} steps, ratio {ratio:g}: {cells[key][0]:.3g} m/s")
    return cells


def table(cells: dict) -> list[str]:
    """The lightest ratio that holds, with all heavier ones, and its added over own inertia; a row for each arrangement."""
    lines = [f"| arrangement | {' | '.join(f'{s}, {f:g} dt' for s in SCHEMES for f in STEPS)} |"]
    lines.append("|" + "---|" * (1 + len(SCHEMES) * len(STEPS)))
    for arrangement in ARRANGEMENTS:
        words = []
        for scheme, step in [(s, f) for s in SCHEMES for f in STEPS]:
            held = None
            for ratio in reversed(RATIOS):
                if not cells[arrangement, scheme, step, ratio][0] <= LIMIT:
                    break
                held = ratio
            inertia = cells[arrangement, scheme, step, held][2] if held else 0.0
            words.append(f"{held:g} ({inertia:.2g})" if held else "none")
        lines.append(f"| {arrangement} | {' | '.join(words)} |")
    return lines


def picture(cells: dict, file: Path) -> None:
    """A field for each scheme and arrangement: dark where a run is unstable, else by its fastest point."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(ARRANGEMENTS), len(SCHEMES), figsize=(10, 8), sharex=True, sharey=True)
    for row, arrangement in zip(axes, ARRANGEMENTS, strict=True):
        for axis, scheme in zip(row, SCHEMES, strict=True):
            speeds = np.array([[cells[arrangement, scheme, step, ratio][0] for ratio in RATIOS] for step in STEPS])
            stable = np.where(speeds <= LIMIT, speeds, np.nan)
            axis.imshow(stable, cmap="Blues", vmin=0, vmax=1.5 * LIMIT, aspect="auto", origin="lower")
            for i, j in np.argwhere(np.isnan(stable)):
                axis.add_patch(plt.Rectangle((j - 0.5, i - 0.5), 1, 1, color="#7a1f1f"))
            axis.set_xticks(range(len(RATIOS)), [f"{r:g}" for r in RATIOS])
            axis.set_yticks(range(len(STEPS)), [f"{s:g}" for s in STEPS])
        row[0].set_ylabel(f"{arrangement}\ntime step")
    for axis, scheme in zip(axes[0], SCHEMES, strict=True):
        axis.set_title(scheme)
    for axis in axes[-1]:
        axis.set_xlabel("density ratio")
    figure.suptitle("Stable (blue) and unstable (dark red)")
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


def _case(arrangement: str) -> Case:
    what = {"heave": "A heaving box", "flap": "A hinged flap", "box": "A box in three degrees of freedom",
            "raft": "Two hinged boxes"}[arrangement]  # fmt: skip
    return Case(
        f"stability_{arrangement}",
        f"{what} let go at density ratios from 0.02 to 8, default scheme at its own time step, 2D",
        "No point of a body gets faster than 1 m/s (a fall of 20 mm gives 0.63 m/s); as a share of 2 m/s, from which on a"
        " cell counts as unstable.",
        {"coarse": 0.04, "medium": 0.02, "paper": 0.01},
        lambda spacing, folder: scene(arrangement, 0.02, spacing, folder),
        lambda sim: Cell(sim, arrangement),
        {"unstable_cells": 0.0, "fastest_point": 0.5},
    )


NAMES = ("stability_heave", "stability_flap", "stability_box", "stability_raft")
CASES = {case.name: case for case in map(_case, ARRANGEMENTS)}


def main() -> None:
    """Make the map."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("."))
    parser.add_argument("--spacing", type=float, default=0.04)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cells = stability_map(options.spacing)
    picture(cells, options.out / "stability_map.png")
    (options.out / "stability_map.md").write_text("\n".join(table(cells)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
