"""Alarms of a run: fluid that is lost or has slipped into a solid, and energy that comes from nowhere.

Each is told once when it begins, warned of and at last an error (`[alarms]` of the scene), with the likeliest cause.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from fsi.errors import RunError
from fsi.owners import FIRST_BODY, PISTON, WALL
from fsi.particles.fixed import NEAR as CROWDED
from fsi.particles.fixed import distances
from fsi.simulation.slipped import Slipped
from fsi.state import Remembers

WARN_LOST = 0.1  # share of `alarms.lost_particles` at which the loss is warned of
WARN_ENERGY = 0.02  # of the energy that there is to come by, from which on energy from nowhere is warned of
LOOKS = 10  # at where the fluid is, in a run
NEAR = 3.0  # spacings from a body within which a particle is lost beside it


class Alarms(Remembers):
    """Watches the fluid and the balance of a simulation; `notes` are its warnings."""

    remembered = ("notes", "_lost", "_first", "_warned", "_looks", "_inside")

    def __init__(self, sim, slipped: Slipped):
        self._sim, self._limits, self._slipped = sim, sim.scene.alarms, slipped
        self._started_with = sim.fluid.count
        tank = sim.scene.tank
        self._seams = [tank.axes.index(a) for a in tank.periodic] if sim.bodies else []
        self.notes: list[str] = []
        self._lost = 0
        self._first = ""  # when and where the first was lost
        self._warned: list[str] = []
        self._looks = self._inside = 0  # at where the fluid is, and how much of it was inside solids at the last

    @property
    def lost_share(self) -> float:
        """Share of the fluid particles at the start that are lost."""
        return self._sim.fluid.lost / self._started_with

    def audit(self) -> dict:
        """For `run.json`."""
        fluid, sides = self._sim.fluid, self._sim.scene.tank.open
        left = {"left_particles": dict(zip(sides, fluid.departed.left.tolist(), strict=True))} if sides else {}
        lost = {"lost_particles": fluid.lost, "lost_share": self.lost_share, "first_lost": self._first}
        return lost | {"slipped_particles": self._inside} | left

    def check(self, kept: str) -> None:
        """After a step. Raises RunError where a limit is passed; `kept` says what the log holds."""
        self._check_energy(kept)
        if self._seams:
            self._check_seams(kept)
        if self._sim.fluid.lost > self._lost:
            self._check_lost(kept)
        if self._sim.time >= (self._looks + 1) / LOOKS * self._sim.scene.duration * (1 - 1e-9):
            self._looks += 1
            self._check_slipped(kept)

    def _warn(self, alarm: str, text: str) -> None:
        """Tell a warning at its first time."""
        if alarm not in self._warned:
            self._warned.append(alarm)
            self.notes.append(text)
            self._sim.report("warning", text)

    # -------------------------------------------------------------------------------------- lost particles

    def _check_lost(self, kept: str) -> None:
        fluid, limit = self._sim.fluid, self._limits.lost_particles
        self._lost, share = fluid.lost, self.lost_share
        if not self._first:
            self._first = f"the first at t = {self._sim.time:.4g} s, last seen at {_point(fluid.departed.last_seen)}"
            self._warn(
                "first lost", f"a particle has left the tank, {self._first}; likeliest cause: {self._cause_of_loss()}"
            )
        told = f"{fluid.lost} of {self._started_with} particles ({100 * share:.2g} %) have left the tank, {self._first}"
        if share >= limit * (1 - 1e-9):
            told = self._told(told, self._cause_of_loss(), f"alarms.lost_particles = {limit:g}", kept)
            raise RunError(told if self._passed()[1] else f"unstable {told}")
        if share >= WARN_LOST * limit * (1 - 1e-9):
            self._warn("lost", self._told(told, self._cause_of_loss()))

    def _cause_of_loss(self) -> str:
        """The likeliest one, of the particle that was lost last."""
        if self.doubled_walls:
            return self.doubled_walls
        side, is_open = self._passed()
        if is_open:
            return f'it went through the open side {side}: move that side of the tank or add "{side}" to tank.walls'
        if body := self._nearest_body(self._sim.fluid.departed.last_seen):
            return f"it was lost beside body {body!r}: try a smaller numerics.courant or a finer spacing"
        through = f"it went through the wall {side}: " if side else ""
        return f"{through}the time step may be too long: try a smaller numerics.courant or numerics.mach"

    def _passed(self) -> tuple[str, bool]:
        """The side of the tank that the particle lost last went through, "" where none, and whether it is open."""
        tank, at, beyond = self._sim.scene.tank, self._sim.fluid.departed.last_seen, {}
        for d, axis in enumerate(tank.axes):
            beyond |= {f"{axis}-": tank.min[d] - at[d], f"{axis}+": at[d] - tank.max[d]}
        side = max(beyond, key=beyond.get)
        return (side, side not in tank.walls) if beyond[side] > 0 else ("", False)

    def _nearest_body(self, at: np.ndarray) -> str | None:
        """The name of the body that a point is beside."""
        fluid = self._sim.fluid
        first = fluid.of_owner(PISTON).stop
        if first == len(fluid.boundary):
            return None
        distance = np.linalg.norm(fluid.boundary[first:] - at, axis=1)
        nearest = int(np.argmin(distance))
        if not distance[nearest] < NEAR * self._sim.scene.spacing:
            return None
        return self._sim.bodies.names[int(fluid.owner[first + nearest]) - FIRST_BODY]

    @cached_property
    def doubled_walls(self) -> str:
        """What to say where particles of the fixed walls stand closer than CROWDED spacings; "" where none do."""
        fluid = self._sim.fluid
        walls, spacing = fluid.boundary[fluid.of_owner(WALL)], self._sim.scene.spacing
        close = np.flatnonzero(distances(walls, walls, spacing, itself=True) < CROWDED * spacing * (1 - 1e-6))
        if len(close) == 0:
            return ""
        return (
            f"the walls are doubled: {len(close)} of their particles are closer than {CROWDED:g} spacings "
            f"to another, such as at {_point(walls[close[0]])}; move the bathymetry or the fixed geoms off the tank's walls"
        )

    # -------------------------------------------------------------------------------------- periodic axes

    def _check_seams(self, kept: str) -> None:
        """Raise RunError for a body that has come to an end of a periodic axis: water beyond would not feel it."""
        sim, fluid = self._sim, self._sim.fluid
        tank, reach = sim.scene.tank, 2 * sim.scene.smoothing_length
        for b, name in enumerate(sim.bodies.names):
            points = fluid.boundary[fluid.of_owner(FIRST_BODY + b)]
            for d in self._seams if len(points) else ():
                low, high = points[:, d].min() - tank.min[d], tank.max[d] - points[:, d].max()
                if min(low, high) < reach:
                    raise RunError(
                        f"at t = {sim.time:.4g} s body {name!r} has come to {min(low, high):.3g} m from the end of the "
                        f"{tank.axes[d]} axis, where the tank repeats itself and bodies do not: moor it, or make the tank "
                        f"longer{kept}"
                    )

    # -------------------------------------------------------------------------------------- inside solids

    def _check_slipped(self, kept: str) -> None:
        fluid, limit = self._sim.fluid, self._limits.lost_particles
        depth = self._slipped.depth(fluid)
        self._inside = int(fluid.reductions.combined(int((depth > self._slipped.limit).sum())))
        if not self._inside:
            return
        at, share = fluid.reductions.at_largest(depth, fluid.position), self._inside / self._started_with
        told = (
            f"{self._inside} of {self._started_with} particles ({100 * share:.2g} %) have slipped between boundary particles "
            f"and are inside a solid or behind a wall, the deepest at {_point(at)}"
        )
        cause = (
            self.doubled_walls
            or "an edge between two solids, or a plate thinner than the boundary: try a finer spacing"
        )
        if share >= limit * (1 - 1e-9):
            raise RunError("unstable " + self._told(told, cause, f"alarms.lost_particles = {limit:g}", kept))
        self._warn("slipped", self._told(told, cause))

    # -------------------------------------------------------------------------------------- energy

    def _check_energy(self, kept: str) -> None:
        balance, limit = self._sim.balance, self._limits.energy
        gained, scale = balance.gained, balance.energy_scale
        if not gained > WARN_ENERGY * min(1.0, limit) * scale:
            return
        told = (
            f"{gained:.3g} J of energy have come from nowhere, {100 * gained / scale:.2g} % of the {scale:.3g} J that the "
            "fluid could fall by or was given"
        )
        if gained > limit * scale:
            raise RunError("unstable " + self._told(told, self._cause_of_energy(), f"alarms.energy = {limit:g}", kept))
        self._warn("energy", self._told(told, self._cause_of_energy()))

    def _cause_of_energy(self) -> str:
        if self.doubled_walls:
            return self.doubled_walls
        fluid = self._sim.fluid
        fastest = fluid.reductions.at_largest((fluid.velocity**2).sum(1), fluid.position)
        body = self._nearest_body(fastest)
        place = f"the fastest particle is at {_point(fastest)}"
        if body:
            return f"{place}, beside body {body!r}: try a smaller numerics.courant or numerics.mach"
        return f"{place}: try a smaller numerics.mach or numerics.courant, or a finer spacing"

    def _told(self, what: str, cause: str, limit: str = "", kept: str = "") -> str:
        """An alarm in words; `limit` is the key that ends the run."""
        sim = self._sim
        when = f"at t = {sim.time:.4g} s (step {sim.step_count}): "
        return f"{when}{what}; likeliest cause: {cause}" + (f"; the limit is {limit}{kept}" if limit else "")


def _point(point: np.ndarray) -> str:
    """A point as coordinates by name, such as x = 1, z = -0.5 m."""
    names = "xz" if len(point) == 2 else "xyz"
    return ", ".join(f"{name} = {c:.4g}" for name, c in zip(names, point, strict=True)) + " m"
