"""Whether a run still stands, and what to say where it does not."""

from __future__ import annotations

import math

import numpy as np

from fsi.errors import RunError
from fsi.state import Remembers

FLUID_LIMIT = 1e3  # speed of the fluid over that of long waves, or over its speed at the start
BODY_LIMIT = 20.0  # speed of a body over that of a fall through half the tank, or over its speed at the start
JUMP_LIMIT = 4.0  # the same for the change of its velocity within a step; the hardest hit comes to 2 sqrt(2)


class Ringing(Remembers):
    """Finds bodies that answer every step with a larger step back, as an unstable exchange with the fluid makes them do.
    Three growing reversals in a row, over which the change of velocity doubles and comes to half a spacing a step, are
    no motion that a solver resolves; a hit, a slam or an end stop reverses once."""

    remembered = ("_last", "_reversals", "_growth")

    def __init__(self, bodies: int, spacing: float):
        self._spacing = spacing
        self._last, self._reversals, self._growth = np.zeros((bodies, 6)), np.zeros(bodies, int), np.ones(bodies)

    def __call__(self, change: np.ndarray, dt: float) -> np.ndarray:
        """Whether each body rings (b,), after a step of dt [s] that changed its velocity by `change` (b, 6): linear, and
        angular times its size [m/s]."""
        size, before = np.linalg.norm(change, axis=1), np.linalg.norm(self._last, axis=1)
        grows = ((change * self._last).sum(1) < 0) & (size > before)
        share = np.divide(size, before, out=np.ones_like(size), where=before > 0)
        self._growth = np.where(grows & (self._reversals > 0), self._growth * share, 1.0)
        self._reversals = np.where(grows, self._reversals + 1, 0)
        self._last = change
        return (self._reversals >= 3) & (self._growth > 2) & (size * dt > 0.5 * self._spacing)


class Stability(Remembers):
    """Watches the fluid and the bodies of a simulation; `logged` is the time [s] of the last frame that was recorded."""

    remembered = ("logged", "_ringing")

    def __init__(self, sim):
        self._sim, scene, fluid = sim, sim.scene, sim.fluid
        wave_speed = math.sqrt(scene.gravity * fluid.depth)
        start = float(np.sqrt(fluid.reductions.largest((fluid.velocity**2).sum(1))))
        self._fastest_fluid = FLUID_LIMIT * max(wave_speed, start, scene.spacing)
        self.logged: float | None = None
        self._pace, self._ringing = math.inf, None
        self._free = bool(sim.bodies and sim.coupler.advice)  # prescribed bodies cannot become unstable
        if self._free:
            height = scene.tank.max[-1] - scene.tank.min[-1]
            speeds = self._speeds(sim.bodies.motion().velocity)
            fall = math.sqrt(scene.gravity * height)
            self._pace = max(fall, start, speeds.max(initial=0.0)) or math.inf
            self._ringing = Ringing(len(speeds), scene.spacing)

    def fastest_body(self) -> float:
        """Speed of the fastest point of a body now [m/s]."""
        return float(self._speeds(self._sim.bodies.motion().velocity).max(initial=0.0))

    def check(self, before: np.ndarray, twist: np.ndarray, wrench: np.ndarray, finite: bool, speed: float) -> None:
        """Twists (b, 6) of the bodies before and after the step, the wrench (b, 6) on them, the speed [m/s] of the fastest
        fluid particle; `finite` where the sums over the fluid are. Raises RunError where the run has become unstable."""
        sim = self._sim
        if sim.bodies:
            self._check_left(sim.bodies.motion().position)
        if self._free:
            self._check_bodies(before, twist, wrench)
        if not finite:
            fault = "a velocity or a force is no longer finite"
        elif speed > self._fastest_fluid:
            fault = f"the fluid moves at {speed:.3g} m/s"
        else:
            return
        advice = sim.alarms.doubled_walls or "try a smaller numerics.mach or numerics.courant, or a finer spacing"
        raise RunError(f"unstable at {self._when()}: {fault}; {advice}{self.kept}")

    def failed(self, fault: RunError) -> RunError:
        """What to raise where the bodies could not be moved: names the fastest one."""
        if not self._free:
            return fault
        if not str(fault).startswith("unstable: "):  # of a user's function or a mooring line, by its own name
            return RunError(f"{fault}, at {self._when()}{self.kept}")
        speeds = self._speeds(self._sim.bodies.motion().velocity)
        worst = int(np.argmax(np.where(np.isfinite(speeds), speeds, np.inf)))
        return self._of_body(worst, speeds[worst], str(fault).removeprefix("unstable: ").partition(";")[0])

    def _check_left(self, centre: np.ndarray) -> None:
        """Raise RunError where a body is outside a wall of the tank with all of it, and can meet no fluid any more; centre
        (b, 3) of the bodies."""
        sim, tank = self._sim, self._sim.scene.tank
        axes = [0, 2] if sim.fluid.dim == 2 else [0, 1, 2]
        inside = centre[:, axes]
        if ((inside >= tank.min) & (inside <= tank.max)).all():
            return
        for axis, low, high in zip(axes, tank.min, tank.max, strict=True):
            for side, end in ((-1, low), (1, high)):
                wall = f"{'xyz'[axis]}{'-' if side < 0 else '+'}"
                gone = side * (centre[:, axis] - end) > sim.movers.reach
                if wall in tank.walls and gone.any():
                    name = sim.bodies.names[int(np.flatnonzero(gone)[0])]
                    raise RunError(
                        f"body {name!r} has left the tank through its {wall} wall at {self._when()}: walls hold water, not "
                        f"bodies; add a geom to the MJCF file for it to touch, a plane for a wall{self.kept}"
                    )

    def _check_bodies(self, before: np.ndarray, twist: np.ndarray, wrench: np.ndarray) -> None:
        change = twist - before
        scaled = change.copy()
        scaled[:, 3:] *= self._sim.movers.reach[:, None]
        rings = self._ringing(scaled, self._sim.dt)
        speeds, jumps = self._speeds(np.array([twist, change]))
        wild = ~np.isfinite(wrench).all(1) | ~(speeds < BODY_LIMIT * self._pace)
        for b in np.flatnonzero(wild | (jumps > JUMP_LIMIT * self._pace) | rings):
            speed = speeds[b]
            if wild[b]:
                raise self._of_body(b, speed)
            if jumps[b] > JUMP_LIMIT * self._pace:
                raise self._of_body(b, speed, f"thrown by {jumps[b]:.3g} m/s within a step")
            raise self._of_body(b, speed, "thrown back harder in every step")

    def _of_body(self, b: int, speed: float, fault: str = "") -> RunError:
        """The error that says which body, when, its added-mass ratio and what to change."""
        sim = self._sim
        ratios = sim.coupler.mass_ratio(sim.bodies)
        known = ratios is not None and np.isfinite(ratios[b])
        inertia = f"the added inertia of the fluid is {ratios[b]:.3g} times its own; " if known else ""
        motion = f"it moves at {speed:.3g} m/s" if np.isfinite(speed) else "its motion is no longer finite"
        what = f"{motion}, {fault}" if fault else motion
        name = sim.bodies.names[b]
        return RunError(
            f"body {name!r} is unstable at {self._when()}: {what}; {inertia}{sim.coupler.advice}{self.kept}"
        )

    def _speeds(self, twist: np.ndarray) -> np.ndarray:
        """Speed (..., b) of the fastest point of each body, or a little more, from twists (..., b, 6)."""
        linear, angular = np.linalg.norm(twist[..., :3], axis=-1), np.linalg.norm(twist[..., 3:], axis=-1)
        return linear + angular * self._sim.movers.reach

    def _when(self) -> str:
        return f"t = {self._sim.time:.4g} s (step {self._sim.step_count})"

    @property
    def kept(self) -> str:
        """What the log holds, to end an error with."""
        return "" if self.logged is None else f"; the log holds the run up to t = {self.logged:.4g} s"
