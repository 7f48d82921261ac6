"""The pressure solvers: `explicit`, `chebyshev` and `converged`, which differ in the weights of their sweeps and in how many
they take (`fsi.fluid.chebyshev`)."""

from __future__ import annotations

import numpy as np

from fsi.fluid.chebyshev import Iteration, iteration, solution
from fsi.fluid.parts import Parts, PressureSolver
from fsi.fluid.response import LinearResponse
from fsi.particles.rows import largest_change
from fsi.scene.model import Scene
from fsi.sph import columns, pressure
from fsi.sph.columns import Constants


def two_fields(scene: Scene) -> bool:
    """Whether a step has sweeps that need the pressures before the last one (`Workspace`)."""
    return scene.numerics.solver == "converged" or scene.numerics.sweeps > 1


def make_solver(parts: Parts) -> PressureSolver:
    """The solver that the scene asks for."""
    numerics = parts.scene.numerics
    if numerics.solver == "converged":
        return Relaxation(parts, solution(parts.scene, parts.depth), numerics.pressure_tolerance)
    return Relaxation(parts, iteration(numerics), None)


class Relaxation:
    """Sweeps with fixed weights, a step's first one from the last step's pressure, as many as there are weights or until one
    changes the pressure by less than `tolerance` of its maximum. Owns the counts of sweeps; the pressures are in the
    workspace."""

    def __init__(self, parts: Parts, how: Iteration, tolerance: float | None):
        self._parts, self.weights, self._tolerance = parts, how.weights, tolerance
        self._lanes, self._dim, self._closed = parts.lanes, parts.scene.dimension, parts.scene.closed
        self._pressure = columns.field(self._dim).p
        self.sweeps, self.most_sweeps, self.unsolved = 0, 0, 0
        self.source = pressure.make_source(self._lanes, self._dim, parts.dense)
        self._silence = LinearResponse.none(self._dim, parts.dtype)

    def update(self, k: Constants, dt: float, response: LinearResponse | None = None) -> None:
        """See `PressureSolver`."""
        parts, work, P = self._parts, self._parts.work, self._pressure
        parts.boundary.extrapolate(work.trial)
        first = parts.dtype(self.weights[0][0])
        rows = work.trial, work.field, work.twin, work.coefficients
        if self._closed:
            self._run(self.source, *rows, k, parts.dtype(dt), first)
            self._take_out_mean()
            parts.halo.refresh(work.field, slice(P, P + 1))
        else:
            self._run_refreshed(work.field, self.source, *rows, k, parts.dtype(dt), first)
        if response:
            self._begin_response(k, response)
        self._relax(k, self.weights[1:], self._tolerance, response)
        if self._closed:
            p, own = work.field[: parts.particles.count, P], parts.particles.own
            p -= parts.reductions.smallest(p[own]) if parts.scene.gravity > 0 else parts.reductions.mean(p[own])
        parts.boundary.extrapolate(work.field, response)

    def settle(self, k: Constants, tolerance: float, most: int) -> None:
        """See `PressureSolver`."""
        parts = self._parts
        parts.work.part()
        self._relax(k, solution(parts.scene, parts.depth, most).weights, tolerance)
        parts.work.join()
        self.sweeps = self.most_sweeps = 0

    def residual(self, rows: int, counts: np.ndarray | None = None) -> float:
        """See `PressureSolver`."""
        work = self._parts.work
        last = work.twin if len(self.weights) > 1 else work.trial
        return self._change(last, work.field[:rows] if counts is None else work.field[:rows] / counts[:, None])

    def state(self) -> dict:
        """See `PressureSolver`."""
        return {"sweeps": self.sweeps, "most_sweeps": self.most_sweeps, "unsolved": self.unsolved}

    def restore(self, state: dict) -> None:
        """See `PressureSolver`."""
        self.sweeps, self.most_sweeps, self.unsolved = (int(state[k]) for k in ("sweeps", "most_sweeps", "unsolved"))

    def _relax(self, k, weights, tolerance: float | None, response: LinearResponse | None = None) -> None:
        """Sweeps with these weights, until one changes the pressure by less than tolerance times its maximum."""
        taken = 0
        for alpha, beta in weights:
            self._parts.boundary.extrapolate(self._parts.work.field, response)
            self._sweep(k, alpha, beta, response or self._silence)
            taken += 1
            if tolerance and self._change(self._parts.work.twin) <= tolerance:
                break
        else:
            self.unsolved += tolerance is not None
        self.sweeps, self.most_sweeps = self.sweeps + 1 + taken, max(self.most_sweeps, 1 + taken)

    def _sweep(self, k, alpha: float, beta: float, response: LinearResponse) -> None:
        """One sweep (`fsi.fluid.chebyshev`)."""
        parts, work = self._parts, self._parts.work
        response.spread()
        variant, weights = (self._lanes, self._dim, parts.dense), (parts.dtype(alpha), parts.dtype(beta))
        responses = response.rows, response.twin, response.low, response.high
        sweep = pressure.make_sweep(*variant, response.columns)
        self._run_refreshed(work.twin, sweep, work.field, work.twin, work.coefficients, k, *weights, *responses)
        work.swap()
        response.swap()
        if response.columns:
            parts.halo.refresh(response.rows, slice(None))

    def _begin_response(self, k, response: LinearResponse) -> None:
        """The first sweep of responses."""
        parts = self._parts
        response.begin(parts.particles.count, parts.boundary.shepard)
        response.spread()
        self._run(
            pressure.make_onset(self._lanes, self._dim, parts.dense, response.columns), parts.work.field,
            parts.work.coefficients, k, parts.dtype(self.weights[0][0]), response.rows, response.low, response.high,
        )  # fmt: skip
        parts.halo.refresh(response.rows, slice(None))

    def _run(self, kernel, *args) -> None:
        self._parts.team.run(kernel, self._parts.near.bounds, self._parts.near.groups, *args)

    def _run_refreshed(self, rows: np.ndarray, kernel, *args) -> None:
        """Run a sweep that fills the pressures of `rows`, and give the ghosts theirs."""
        parts, P = self._parts, self._pressure

        def run(bounds, groups) -> None:
            parts.team.run(kernel, bounds, groups, *args)

        parts.halo.sweep(run, parts.near, rows, slice(P, P + 1))

    def _change(self, last, now=None) -> float:
        """Change of the pressure in the rows `now` (those of `field` if not given) from the rows `last`, as a share of its
        largest value."""
        parts = self._parts
        rows = parts.work.field[: parts.particles.count] if now is None else now
        found = largest_change(rows, last, len(rows), self._pressure)
        largest, change = (parts.reductions.largest_of(value) for value in found)
        return change / largest if largest > 0 else 0.0

    def _take_out_mean(self) -> None:
        """Without a free surface the pressure is known up to a constant only, and has a solution only for a source
        without a mean: take the mean out of the source, which the first sweep has used, or the pressure would grow."""
        parts, count = self._parts, self._parts.particles.count
        coefficients = parts.work.coefficients[:count]
        mean = parts.reductions.mean(coefficients[parts.particles.own, columns.SOURCE])
        coefficients[:, columns.SOURCE] -= mean
        weight = 1 + coefficients[:, columns.INNER] * parts.dtype(self.weights[0][0] - 1)
        with np.errstate(invalid="ignore", divide="ignore"):  # ghosts, which a refresh overwrites, may have no diagonal
            parts.work.field[:count, self._pressure] += weight * mean / coefficients[:, columns.DIAGONAL]
