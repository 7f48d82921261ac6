"""The balance of energy and momentum of a run, step by step, and the time series that are logged from them."""

from __future__ import annotations

import math

import numpy as np

from fsi.owners import FIRST_BODY, PISTON
from fsi.sph.columns import corrector_sums
from fsi.state import Remembers

FALL = 0.1  # of the depth: energy that is at hand in any fluid; its volume is right to some 0.1 %
STILL = 0.01  # speed without gravity that counts as still [m/s]: lattices that round walls cut fall into place at some mm/s


class Balance(Remembers):
    """Energies [J], work [J] and the audit of a simulation.

    At every logged step the audit compares the change of the fluid's momentum with the impulse of gravity and other body
    forces, less the impulses on walls, wavemaker and bodies; `momentum_residual` is a share of the impulse of the fluid's
    weight (or of the largest force). It compares the forces that moved the bodies with those that the settled pressure
    took out of the fluid; `body_impulse_residual` is a share of the largest of these forces or weights of bodies. Energy:
    `exchanged_work` sums the work between the fluid and what moves in it, to and fro; `work_residual` is the share of it
    that the fluid lost over and above that work and the sponge's loss: to viscosity, impacts and the scheme itself.
    """

    remembered = (
        "kinetic", "potential", "momentum", "energy_at_start", "body_work", "wavemaker_work", "volume", "max_speed", "dt",
        "guarded", "wrench", "exchanged_work", "sponge_loss", "momentum_residual", "body_impulse_residual", "audits",
        "_stopped", "_gone", "force_work", "_forced", "_available",
    )  # fmt: skip

    def __init__(self, scene, fluid, bodies):
        self.scene, self.fluid, self.bodies = scene, fluid, bodies
        k, dim = fluid.k, fluid.dim
        self.mass = float(k.mass)
        self.body_work = self.wavemaker_work = self.force_work = 0.0
        self.volume = fluid.total_count * self._cell_volume()
        self.max_speed, self.dt, self.guarded = 0.0, 0.0, 0
        self.wrench = np.zeros((fluid.owners, 6))
        self.exchanged_work = self.sponge_loss = self._forced = 0.0
        self.momentum_residual, self.body_impulse_residual, self.audits = 0.0, 0.0, 0
        self._stopped = np.zeros((fluid.owners, 6))  # impulse of the wall guard, which bodies get in the step after
        self._before = None
        self._dim = dim
        self._gone = np.zeros(dim)  # momentum of the particles that were lost before the last step
        self.open()

    def open(self) -> None:
        """Open the balance with the fluid as it is: before the first step, after which no one sets velocities."""
        fluid = self.fluid
        r, summed = self._relative_density(), fluid.reductions.weighted
        self.kinetic = 0.5 * self.mass * float(summed(r, (fluid.velocity**2).sum(1)))
        self.potential = self._weight() * float(summed(r, fluid.position[:, -1]))
        self.momentum = self.mass * summed(r, fluid.velocity)
        self.energy_at_start = self.kinetic + self.potential
        base = float(np.prod(np.subtract(self.scene.tank.max, self.scene.tank.min)[:-1]))
        layers = self.scene.tank.min[-1] + (np.arange(fluid.count) + 0.5) * self._cell_volume() / base
        flat = self._weight() * float(np.sort(r)[::-1] @ layers)  # the heaviest at the floor
        fall = self._weight() * max(self.scene.spacing, FALL * fluid.depth) * float(r.sum())
        self._available = self.kinetic + max(self.potential - flat, fall, 0.5 * self.mass * r.sum() * STILL**2)

    def _relative_density(self) -> np.ndarray:
        return np.ones(self.fluid.count) if self.fluid.relative is None else self.fluid.relative

    def _weight(self) -> float:
        return self.mass * self.scene.gravity

    def _cell_volume(self) -> float:
        return self.mass / self.scene.fluid.density

    def open_audit(self) -> None:
        """Called after the pressure of a step is final and before the corrector: note momentum and all forces."""
        forces = self.fluid.wrench(viscous=True, walls=True)[:, :3]
        momentum = self.momentum - (self.mass * self.fluid.departed.gone[: self._dim] - self._gone)
        drive = self.mass * self.fluid.driven()
        if self.fluid.sea:
            drive += self.fluid.sea.impulse / self.fluid.dt
        self._before = momentum, forces, drive, self.fluid.total_count

    def ordered(self, sums: np.ndarray, logged: bool) -> np.ndarray:
        """The sums of a step, where they must not depend on who holds the particles: those that are logged, and the momentum
        that body forces work on."""
        fluid, place = self.fluid, corrector_sums(self._dim)
        if not (logged or self.scene.fluid.acceleration):
            return sums
        sums, found = sums.copy(), fluid.sums()
        sums[place.kinetic], sums[place.height], sums[place.volume] = found[:3]
        sums[place.momentum : place.damped] = found[3:]
        return sums

    def close(self, sums, impulse, wrench, twist, new_twist, dt) -> None:
        """Enter a step: the sums of the corrector, the guard's impulse (owners, 6), the wrench (owners, 6), the twists
        (owners, 6) before and after."""
        dim = self._dim
        place = corrector_sums(dim)
        self.kinetic, self.max_speed, self.dt = sums[place.kinetic], math.sqrt(sums[place.speed2]), dt
        self.potential = self._weight() * sums[place.height]
        self.volume = self._cell_volume() * sums[place.volume]
        self.guarded += int(sums[place.guarded])
        self.momentum = sums[place.momentum : place.damped]
        self.wrench = wrench
        power = (wrench * 0.5 * (twist + new_twist)).sum(1)
        self.body_work += dt * power[FIRST_BODY:].sum()
        stops = (impulse * 0.5 * (twist + new_twist))[PISTON:FIRST_BODY].sum()  # by the wall guard
        self.wavemaker_work -= dt * power[PISTON:FIRST_BODY].sum() + stops
        self._book_forces(dt)
        self._gone = self.mass * self.fluid.departed.gone[:dim]
        self.exchanged_work += dt * np.abs(power[PISTON:]).sum()
        self.sponge_loss += sums[place.loss]
        if self._before is not None:
            if self.bodies:
                self._audit_bodies(dt)
            self._audit(sums[place.damped : place.loss], impulse, dt)
        self._stopped = impulse

    def _book_forces(self, dt) -> None:
        """Work of the accelerations of all fluid besides gravity, along the way of the step, dt u; of the zones and
        the walls of a sea."""
        fluid, scene = self.fluid, self.scene.fluid
        work = 0.0
        if scene.acceleration is not None:
            work += dt * float(np.dot(scene.acceleration, self.momentum))
        if fluid.force.gradient is not None:
            middle = fluid.position - 0.5 * dt * fluid.velocity
            push = (middle @ fluid.force.gradient.T * fluid.velocity).sum(1)
            work += dt * self.mass * float(fluid.reductions.weighted(self._relative_density(), push))
        if fluid.sea:
            work += fluid.sea.given
            self.wavemaker_work += dt * fluid.sea.power
            self.exchanged_work += dt * abs(fluid.sea.power)
        self.force_work += work
        self._forced += abs(work)

    def _audit_bodies(self, dt) -> None:
        given = (self.wrench - self._stopped / dt)[FIRST_BODY:, :3]
        taken = self._before[1][FIRST_BODY:]
        scale = max(np.abs(taken).max(initial=0.0), self.scene.gravity * self.bodies.mass.max(initial=0.0), 1e-300)
        residual = float(np.abs(given - taken).max(initial=0.0) / scale)
        self.body_impulse_residual = max(self.body_impulse_residual, residual)

    def _audit(self, sponged, impulse, dt) -> None:
        momentum, forces, drive, count = self._before
        force = forces.sum(0)
        axes = [0, 2] if self._dim == 2 else [0, 1, 2]
        expected = dt * (drive - force[axes]) - impulse[:, :3].sum(0)[axes] - sponged
        scale = max(dt * self._weight() * count, dt * np.abs(force).max(), np.abs(momentum).max(), 1e-300)
        residual = float(np.abs(self.momentum - momentum - expected).max() / scale)
        self.momentum_residual = max(self.momentum_residual, residual)
        self.audits += 1
        self._before = None

    @property
    def underway(self) -> np.ndarray:
        """Impulses (owners, 6) that the wall guard took from the fluid in the last step, and bodies get in the next."""
        return self._stopped

    @property
    def dissipated(self) -> float:
        """Energy the fluid has lost to viscosity, impacts, the sponge and the scheme itself [J]; what lost particles took
        along is none of it."""
        given = self.wavemaker_work + self.force_work - self.body_work
        return self.energy_at_start + given - self.kinetic - self.potential - self.carried_away

    @property
    def carried_away(self) -> float:
        """Kinetic and potential energy of the particles that were lost [J]."""
        kinetic, height = self.fluid.departed.gone[self._dim :]
        return self.mass * kinetic + self._weight() * height

    @property
    def gained(self) -> float:
        """Energy that has come from nowhere [J]: more than waves, bodies and body forces gave and the sponge left."""
        return self.sponge_loss - self.dissipated

    @property
    def energy_scale(self) -> float:
        """What `gained` is measured against [J]: the larger of the energy at hand and the work done, to and fro. At hand is
        the kinetic energy at the start and the potential energy over that of the same liquids lying flat in the empty
        tank, or of a fall by a tenth of the depth."""
        return max(self._available, self.exchanged_work + self._forced)

    @property
    def work_residual(self) -> float | None:
        """See the class; None where no work was exchanged."""
        return (self.dissipated - self.sponge_loss) / self.exchanged_work if self.exchanged_work > 0 else None

    def audit(self) -> dict:
        """For `run.json`."""
        return {
            "momentum_residual": self.momentum_residual,
            "momentum_audits": self.audits,
            **({"body_impulse_residual": self.body_impulse_residual} if self.bodies else {}),
            "energy_at_start": self.energy_at_start,
            "kinetic_energy": self.kinetic,
            "potential_energy": self.potential,
            "wavemaker_work": self.wavemaker_work,
            "body_work": self.body_work,
            "force_work": self.force_work,
            "carried_away": self.carried_away,
            "dissipated_energy": self.dissipated,
            "sponge_loss": self.sponge_loss,
            "exchanged_work": self.exchanged_work,
            "work_residual": self.work_residual,
            "wall_guard_stops": self.guarded,
            "pressure_sweeps": self.fluid.solver.sweeps,
            "most_pressure_sweeps_in_a_step": self.fluid.solver.most_sweeps,
            "steps_without_converged_pressure": self.fluid.solver.unsolved,
        }

    def series(self, readings: dict | None = None) -> dict:
        """All time series of the run folder at this instant, with the readings of the instruments."""
        fluid = self.fluid
        out = {
            "kinetic_energy": self.kinetic,
            "potential_energy": self.potential,
            "dissipated_energy": self.dissipated,
            "body_work": self.body_work,
            "wavemaker_work": self.wavemaker_work,
            "time_step": self.dt,
            "max_speed": self.max_speed,
            "volume": self.volume,
            "lost_particles": float(fluid.lost),
            "pressure_residual": fluid.residual(),
            **(readings or {}),
        }
        if self.bodies:
            out |= self._body_series()
        return out

    def _body_series(self) -> dict:
        motion, (dry_position, dry_rotation) = self.bodies.motion(), self.bodies.dry_poses()
        return {
            "body_position": motion.position,
            "body_velocity": motion.velocity[:, :3],
            "body_angular_velocity": motion.velocity[:, 3:],
            "body_quaternion": quaternions(motion.rotation),
            "body_force": self.wrench[FIRST_BODY:, :3],
            "body_torque": self.wrench[FIRST_BODY:, 3:],
            "dry_position": dry_position,
            "dry_quaternion": quaternions(dry_rotation),
            **self.bodies.joints(),
            **self.bodies.sensors(self.wrench[FIRST_BODY:]),
            **self.bodies.controls(),
            **self.bodies.moorings(),
        }


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions (b, 4) wxyz, w >= 0, of rotation matrices (b, 3, 3), by the branch with the largest divisor
    (Shepperd 1978)."""
    return np.array([_quaternion(r.tolist()) for r in rotation]).reshape(-1, 4)


def _quaternion(r: list[list[float]]) -> list[float]:
    trace = r[0][0] + r[1][1] + r[2][2]
    diagonal = (r[0][0], r[1][1], r[2][2])
    if trace >= max(diagonal):
        q = [1 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    else:
        i = diagonal.index(max(diagonal))
        j, m = (i + 1) % 3, (i + 2) % 3
        q = [0.0] * 4
        q[0] = r[m][j] - r[j][m]
        q[1 + i] = 1 + r[i][i] - r[j][j] - r[m][m]
        q[1 + j] = r[j][i] + r[i][j]
        q[1 + m] = r[m][i] + r[i][m]
    norm = math.copysign(math.hypot(*q), q[0])
    return [c / norm for c in q]
