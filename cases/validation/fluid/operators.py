"""The kernel and the discrete operators against exact derivatives, and what a step conserves.

kernel_2d, kernel_3d: on a periodic lattice, sums of W, of x grad W (exactly -1 on each axis) and of the Laplacian's weight
(second moment 1), then gradient and Laplacian of sin(2 pi x / L): errors of order two in the spacing at a fixed ratio h / dr,
and the gradient once more on particles that stand off the lattice by up to a tenth of a spacing, where no operator of this
kind, uncorrected, converges. Ratio and sums follow the variant of the numerics.

free_2d, free_3d: a blob of jittered particles without gravity, walls and viscosity that turns and strains for 50 steps. The
forces of a pair are opposite and central, so that momentum and angular momentum stay to round-off (sweeps in double
precision) whatever the pressure; the change of kinetic energy over the time of one turn by a radian is reported.
"""

from __future__ import annotations

import itertools
import math
import time as clock

import numpy as np

from cases.validation.engine.case import Case, Measure, Row, met
from cases.validation.engine.solvers import SOLVERS
from fsi.scene.numerics import Numerics
from fsi.simulation.loop import Simulation
from fsi.sph import kernel

LENGTH = 1.0  # of the periodic box [m]
JITTER = 0.1  # [spacing]


class PeriodicSums:
    """Sums over the neighbours in a periodic box of count**dim particles, all in `here` (count, .., dim)."""

    def __init__(self, count: int, dim: int, ratio: float, jitter: float = 0.0):
        self.dr, self.dim, self.h = LENGTH / count, dim, ratio * LENGTH / count
        cells = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1)
        off = np.random.default_rng(1).uniform(-jitter, jitter, cells.shape) if jitter else 0.0
        self.here = (cells + 0.5 + off) * self.dr
        reach = math.ceil(2 * ratio + 2 * jitter)
        self.offsets = [o for o in itertools.product(range(-reach, reach + 1), repeat=dim) if any(o)]

    def over(self, term, *fields):
        """Sum of term(x_ij, r, field_j - field_i, ..) over the neighbours of each particle."""
        total, axes = 0.0, tuple(range(self.dim))
        for offset in self.offsets:
            there = np.roll(self.here, offset, axes)
            x = self.here - there
            x -= LENGTH * np.round(x / LENGTH)
            changes = [np.roll(f, offset, axes) - f for f in fields]
            total = total + term(x, np.sqrt((x**2).sum(-1)), *changes)
        return total

    def gradient(self, field):
        """V sum (f_j - f_i) grad W along x."""
        volume = self.dr**self.dim
        return self.over(
            lambda x, r, f: -volume * f * kernel.gradient_factor(r, self.h, self.dim) * x[..., 0], field
        )  # fmt: skip

    def laplacian(self, field, moment: float):
        """2 V sum a (f_j - f_i) over the second moment, a the weight of the pressure equation."""
        volume = 2 * self.dr**self.dim / moment
        return self.over(lambda x, r, f: volume * f * self.weight(r), field)

    def weight(self, r):
        return kernel.gradient_factor(r, self.h, self.dim) * r**2 / (r**2 + (0.1 * self.h) ** 2)


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def kernel_errors(count: int, dim: int, ratio: float) -> dict[str, float]:
    """Errors of moments and derivatives at this resolution, relative."""
    k = 2 * math.pi / LENGTH
    sums, strewn = PeriodicSums(count, dim, ratio), PeriodicSums(count, dim, ratio, JITTER)
    lattice, volume = kernel.lattice(sums.dr, sums.h, dim), sums.dr**dim
    first = volume * sums.over(lambda x, r: kernel.gradient_factor(r, sums.h, dim) * x[..., 0] ** 2)
    x, y = k * sums.here[..., 0], k * strewn.here[..., 0]
    return {
        "integral": lattice.density * volume - 1,
        "first_moment": float(first.flat[0]) - 1,
        "gradient": rms(sums.gradient(np.sin(x)) - k * np.cos(x)) / (k * math.sqrt(0.5)),
        "laplacian": rms(sums.laplacian(np.sin(x), lattice.second_moment) + k**2 * np.sin(x)) / (k**2 * math.sqrt(0.5)),
        "gradient_strewn": rms(strewn.gradient(np.sin(y)) - k * np.cos(y)) / (k * math.sqrt(0.5)),
    }


def run_kernel(case: Case, level: str, solver: str, *_) -> tuple[Row, str]:
    """The row of the sums at one level; there are no steps."""
    dim = 2 if case.name.endswith("2d") else 3
    ratio = Numerics(**{k: v for k, v in SOLVERS[solver].items() if k == "smoothing_ratio"}).smoothing_ratio
    start, count = clock.perf_counter(), round(LENGTH / case.spacing[level])
    error = kernel_errors(count, dim, ratio)
    row = Row(
        case=case.name, level=level, solver=solver, spacing=case.spacing[level], dimension=dim, particles=count**dim,
        steps=0, particle_steps=0, time_step=0.0, wall_seconds=clock.perf_counter() - start, simulated_seconds=0.0,
        memory_bytes=8 * (2 * dim + 2) * count**dim, error=error, target=dict(case.target),
        passed=all(met(error[name], target) for name, target in case.target.items()),
    )  # fmt: skip
    return row, ""


SPIN, STRAIN, RADIUS, STEPS = 1.0, 0.3, 0.5, 50  # [1/s], [1/s], [m], steps


class Freely(Measure):
    """Momentum, angular momentum and kinetic energy of a blob with nothing around it."""

    def begin(self, sim: Simulation) -> None:
        fluid, rng = sim.fluid, np.random.default_rng(2)
        fluid.position += rng.uniform(-0.2, 0.2, fluid.position.shape) * sim.scene.spacing
        x, z = fluid.position[:, 0], fluid.position[:, -1]
        fluid.velocity[:, 0] = SPIN * z + STRAIN * x
        fluid.velocity[:, -1] = -SPIN * x - STRAIN * z
        self.start = self.sums(sim)
        self.scale = np.abs(fluid.velocity).sum(), self.size(fluid) @ np.sqrt((fluid.velocity**2).sum(1))

    def size(self, fluid) -> np.ndarray:
        return np.sqrt((fluid.position**2).sum(1))

    def sums(self, sim: Simulation):
        x, u = sim.fluid.position, sim.fluid.velocity
        spin = x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0] if sim.scene.dimension == 2 else np.cross(x, u)
        return u.sum(0), spin.sum(0), float((u**2).sum())

    def sample(self, sim: Simulation) -> None:
        self.end, self.time = self.sums(sim), sim.time

    def errors(self) -> dict[str, float]:
        (p0, l0, e0), (p1, l1, e1) = self.start, self.end
        return {
            "momentum": float(np.abs(p1 - p0).max() / self.scale[0]),
            "angular_momentum": float(np.abs(l1 - l0).max() / self.scale[1]),
            "energy_rate": (e1 / e0 - 1) / (SPIN * self.time),
        }


def _blob(dimension: int):
    def scene(spacing: float, folder) -> dict:
        half, wall = [RADIUS] * dimension, [2 * RADIUS] * dimension
        step = 0.1 * spacing / (SPIN * RADIUS)
        return {
            "dimension": dimension,
            "duration": STEPS * step,
            "gravity": 0.0,
            "tank": {"min": [-w for w in wall], "max": wall, "walls": []},
            "fluid": {
                "start": "zero",
                "kinematic_viscosity": 0.0,
                "blocks": [{"min": [-h for h in half], "max": half}],
            },
            "numerics": {"precision": "double", "fixed_time_step": step},
        }

    return scene


REFERENCE = "Exact: moments of the kernel; derivatives of a sine (root mean square, share of the exact)."
KERNEL = {"integral": 0.02, "first_moment": 0.02, "gradient": 0.05, "laplacian": 0.05, "gradient_strewn": 0.1}
FREE = {"momentum": 1e-13, "angular_momentum": 1e-13, "energy_rate": 0.05}

NAMES = ("kernel_2d", "kernel_3d", "free_2d", "free_3d")
CASES = {
    case.name: case
    for case in (
        *(
            Case(
                f"kernel_{dim}d", f"Kernel and operators on a lattice in {dim} dimensions", REFERENCE, spacing, lambda *_: {},
                None, KERNEL, run=run_kernel,
                reasons="on particles off the lattice the uncorrected sums do not reproduce a linear field; their error"
                " depends on the disorder and on h / dr alone.",
            )
            for dim, spacing in (
                (2, {"coarse": LENGTH / 25, "medium": LENGTH / 50, "paper": LENGTH / 100}),
                (3, {"coarse": LENGTH / 20, "medium": LENGTH / 28, "paper": LENGTH / 40}),
            )
        ),
        *(
            Case(
                f"free_{dim}d", f"A blob turns and strains freely in {dim} dimensions",
                "Exact: momentum and angular momentum to round-off; the rate of kinetic energy is reported.",
                spacing, _blob(dim), Freely, FREE,
            )
            for dim, spacing in (
                (2, {"coarse": LENGTH / 20, "medium": LENGTH / 40, "paper": LENGTH / 80}),
                (3, {"coarse": LENGTH / 12, "medium": LENGTH / 16, "paper": LENGTH / 24}),
            )
        ),
    )
}  # fmt: skip
