"""The balance of energy and momentum of a run, step by step, and the time series that are logged from them."""

from __future__ import annotations

import math

import numpy as np

from fsi.fluid.gauges import elevation, pressure_at
from fsi.particles.layout import FIRST_BODY, PISTON
from fsi.sph import corrector
from fsi.state import Remembers


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
        "_stopped",
    )  # fmt: skip

    def __init__(self, scene, fluid, bodies):
        self.scene, self.fluid, self.bodies = scene, fluid, bodies
        k, dim = fluid.k, fluid.dim
        self.mass = float(k.mass)
        r = np.ones(fluid.count) if fluid.relative is None else fluid.relative
        self.kinetic = 0.5 * self.mass * float(r @ (fluid.velocity**2).sum(1))
        self.potential = self._weight() * float(r @ fluid.position[:, -1])
        self.momentum = self.mass * (r @ fluid.velocity)
        self.energy_at_start = self.kinetic + self.potential
        self.body_work = self.wavemaker_work = 0.0
        self.volume = fluid.count * self._cell_volume()
        self.max_speed, self.dt, self.guarded = 0.0, 0.0, 0
        self.wrench = np.zeros((fluid.owners, 6))
        self.exchanged_work = self.sponge_loss = 0.0
        self.momentum_residual, self.body_impulse_residual, self.audits = 0.0, 0.0, 0
        self._stopped = np.zeros((fluid.owners, 6))  # impulse of the wall guard, which bodies get in the step after
        self._before = None
        self._dim = dim

    def _weight(self) -> float:
        return self.mass * self.scene.gravity

    def _cell_volume(self) -> float:
        return self.mass / self.scene.fluid.density

    def open_audit(self) -> None:
        """Called after the pressure of a step is final and before the corrector: note momentum and all forces."""
        forces = self.fluid.wrench(viscous=True, walls=True)[:, :3]
        self._before = self.momentum.copy(), forces, self.mass * self.fluid.driven(), self.fluid.count

    def close(self, sums, impulse, wrench, twist, new_twist, dt) -> None:
        """Enter a step: the sums of the corrector, the guard's impulse (owners, 6), the wrench (owners, 6), the twists
        (owners, 6) before and after."""
        dim = self._dim
        self.kinetic, self.max_speed, self.dt = sums[corrector.KINETIC], math.sqrt(sums[corrector.SPEED2]), dt
        self.potential = self._weight() * sums[corrector.HEIGHT]
        self.volume = self._cell_volume() * sums[corrector.VOLUME]
        self.guarded += int(sums[corrector.GUARDED])
        self.momentum = sums[corrector.MOMENTUM : corrector.MOMENTUM + dim]
        self.wrench = wrench
        power = (wrench * 0.5 * (twist + new_twist)).sum(1)
        self.body_work += dt * power[FIRST_BODY:].sum()
        self.wavemaker_work -= dt * power[PISTON:FIRST_BODY].sum()
        self.exchanged_work += dt * np.abs(power[PISTON:]).sum()
        self.sponge_loss += sums[corrector.MOMENTUM + 2 * dim]
        if self._before is not None:
            if self.bodies:
                self._audit_bodies(dt)
            self._audit(sums[corrector.MOMENTUM + dim : corrector.MOMENTUM + 2 * dim], impulse, dt)
        self._stopped = impulse

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
        """Energy the fluid has lost to viscosity, impacts, the sponge and the scheme itself [J]."""
        return self.energy_at_start + self.wavemaker_work - self.body_work - self.kinetic - self.potential

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
            "dissipated_energy": self.dissipated,
            "sponge_loss": self.sponge_loss,
            "exchanged_work": self.exchanged_work,
            "work_residual": self.work_residual,
            "wall_guard_stops": self.guarded,
            "pressure_sweeps": self.fluid.sweeps,
            "most_pressure_sweeps_in_a_step": self.fluid.most_sweeps,
            "steps_without_converged_pressure": self.fluid.unsolved,
        }

    def series(self) -> dict:
        """All time series of the run folder at this instant."""
        fluid, scene, h = self.fluid, self.scene, self.scene.smoothing_length
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
        }
        if scene.gauges:
            points = [(g.x,) if fluid.dim == 2 else (g.x, g.y) for g in scene.gauges.values()]
            level = scene.fluid.still_water_level
            heights = [elevation(fluid.position, np.array(p), scene.spacing, h) - level for p in points]
            out["elevation"] = np.array(heights)
        if scene.probes:
            weight = scene.fluid.density * scene.gravity
            values = [
                pressure_at(fluid.position, fluid.pressure_values, np.array(p.position), h, weight)
                for p in scene.probes.values()
            ]
            out["pressure"] = np.array(values)
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
