"""The run: owns the loop, and binds fluid, bodies, coupler and recorders."""

from __future__ import annotations

import math
import time as clock
from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from fsi.compute import jit
from fsi.compute.team import Team, available_threads
from fsi.errors import RunError, SceneError
from fsi.fluid.choice import make_fluid
from fsi.fluid.fluid import Fluid
from fsi.fluid.gauges import dry_gauges
from fsi.fluid.timestep import TimeStep, to_reach
from fsi.owners import FIRST_BODY, WALL
from fsi.particles.layout import build
from fsi.protocols import BodySet, Controller, Coupler, Event, Frame, Moment, Recorder, Solid
from fsi.scene.binding import bind
from fsi.scene.geometry import piston_motion, start, wave_depth
from fsi.scene.model import Scene
from fsi.simulation.alarms import Alarms
from fsi.simulation.balance import Balance
from fsi.simulation.events import Watch
from fsi.simulation.instruments import Instruments
from fsi.simulation.motion import Motion, Movers
from fsi.simulation.slipped import Slipped
from fsi.simulation.stability import Stability
from fsi.sph.columns import corrector_sums
from fsi.state import Remembers


class BodyLoads:
    """The fluid as a coupler sees it (`FluidLoads`): the bodies alone, without walls and wavemaker.

    `carried` (b, 6): force that the wall guard's impulses of the last step amount to. `updates` and `responses` count
    the pressure updates and the linear responses that were asked for.
    """

    def __init__(self, fluid: Fluid, others: np.ndarray, carried: np.ndarray):
        self.fluid, self.others, self.carried = fluid, others, carried
        self.updates = self.responses = 0

    def pressure(self, acceleration: np.ndarray) -> np.ndarray:
        self.updates += 1
        return self.fluid.pressure(np.concatenate([self.others, acceleration]))[FIRST_BODY:] + self.carried

    def respond(self, acceleration: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.updates += 1
        self.responses += len(units)
        units = np.concatenate([np.zeros((len(units), *self.others.shape)), units], axis=1)
        wrench, changes, wrenches = self.fluid.respond(np.concatenate([self.others, acceleration]), units)
        return wrench[FIRST_BODY:] + self.carried, changes, wrenches[:, FIRST_BODY:]

    def add(self, response: np.ndarray, factor: float) -> None:
        self.fluid.add(response, factor)


class Simulation(Remembers):
    """A run of a scene.

    Bodies, coupler and bathymetry are built as the scene says; `bodies` and `coupler` (together) and `ground` (the bathymetry)
    take their place where they are given; `ranks`: of the processes that the run is shared among. Raises SceneError where the
    scene cannot be built, RunError where the run fails.
    `state()` is all that the steps to come depend on (`fsi.protocols.Stateful`); `fsi.open` is the door for users.
    """

    remembered = (
        "time", "dt", "step_count", "fluid", "balance", "instruments", "bodies", "coupler", "absorber", "_limits", "_speed",
        "_acceleration", "_stopped", "_passes", "_due", "_stability", "_watch", "alarms", "control", "_settled",
    )  # fmt: skip

    def __init__(
        self,
        scene: Scene,
        *,
        bodies: BodySet | None = None,
        coupler: Coupler | None = None,
        ground: Solid | None = None,
        recorders: Sequence[Recorder] = (),
        threads: int | None = None,
        ranks: Any = None,
    ):
        bodies, coupler, ground = _built(scene, bodies, coupler, ground)
        self.scene, self.bodies, self.coupler, self.recorders = scene, bodies, coupler, list(recorders)
        layout = build(scene, bodies, ground)
        self.team = _team(threads)
        self.ranks = ranks  # `fsi.ranks.start.Membership`, None in a run of one process
        self.fluid = make_fluid(scene, layout, self.team, **(ranks.parts(scene, layout) if ranks else {}))
        self.movers = self._movers()
        self.glue = None
        if layout.glued is not None:
            from fsi.simulation.glue import Glue

            self.glue = Glue(self.fluid, bodies, layout.glued)
        self.balance = Balance(scene, self.fluid, bodies)
        self.instruments = Instruments(scene, self.fluid, bodies)
        self.time, self.dt, self.step_count = 0.0, 0.0, 0
        self._notes = [
            *([jit.NOTE] if jit.NOTE else []),
            *layout.notes,
            *dry_gauges(scene, layout.position, layout.boundary),
        ]
        self.phases: dict[str, float] = defaultdict(float)
        self._limits = TimeStep(scene, layout.depth)
        self._notes += self._limits.notes
        self._speed = float(np.sqrt(self.fluid.reductions.largest((layout.velocity**2).sum(1))))
        self._acceleration = scene.gravity
        self._stopped = np.zeros((self.fluid.owners, 6))  # impulse of the wall guard, not yet handed to its owners
        self._passes = np.zeros(3)  # pressure updates, linear responses, most updates in a step
        self._due = {"series": 0.0, "particles": 0.0}
        self._stability = Stability(self)
        self.alarms = Alarms(self, Slipped(scene, bodies, ground))
        self.events: list[Event] = []
        self._watch = Watch(scene, layout.depth, bodies)
        self._began = clock.perf_counter()
        self._recording = False
        fixed = ground is not None or any(owner == WALL for owner, _ in (bodies.solids() if bodies else ()))
        self._settled = start(scene, fixed) != "settled" or self.glue is not None
        self.control = None
        if scene.control:
            from fsi.simulation.control import controller_of

            if (controller := controller_of(scene, scene.name)) is not None:
                self.steer(controller, scene.control.interval)

    def steer(self, controller: Controller, interval: float | None = None) -> None:
        """Have a controller called before every step, or every `interval` seconds. Raises SceneError where there is nothing to
        control, or a controller already."""
        from fsi.simulation.control import Control
        from fsi.simulation.view import View

        if self.control:
            raise SceneError("the scene names a controller already", key="control", fix="use one of the two")
        if not self.bodies or not self.bodies.actuator_names:
            fault, fix = "the body files have no actuator", "add <actuator> to one, or leave the controller out"
            raise SceneError(fault, key="control", fix=fix)
        self.control = Control(controller, interval, View(self))

    def _movers(self) -> Movers:
        waves, absorber = self.scene.waves, None
        motion = piston_motion(self.scene)
        if waves and waves.absorb:
            from fsi.simulation.absorber import Absorber

            absorber = Absorber(self.scene, motion, wave_depth(self.scene))
        return Movers(self.fluid, motion, self.bodies, absorber)

    @property
    def absorber(self):
        """Active absorption by the piston, None where there is none."""
        return self.movers.absorber

    # -------------------------------------------------------------------------------------- state

    def state(self) -> dict:
        """All that the steps to come, and what is told of the whole run at its end, depend on."""
        events = [[*map(float, e.moment), e.level, e.text] for e in self.events]
        told = {"wall_time": self.now.wall_time, "phases": dict(self.phases), "events": events}
        return super().state() | {"told": told}

    def restore(self, state: dict) -> None:
        """Go on from the state of another simulation of the same scene; this one must be fresh. Raises ValueError where the
        state is one of another scene."""
        if self.step_count:
            raise ValueError("only a simulation that has taken no step can take over a state")
        self.rewind(state)

    def rewind(self, state: dict) -> None:
        """Go back to an earlier state of this simulation, from which it goes on as then, bit for bit."""
        told = state["told"]
        super().restore({name: value for name, value in state.items() if name != "told"})
        self.phases.update(told["phases"])
        self._began = clock.perf_counter() - told["wall_time"]
        self.events = [Event(Moment(t, int(n), wall), level, text) for t, n, wall, level, text in told["events"]]

    def reseed(self, seed: int) -> None:
        """At t = 0: give waves that have a seed this one."""
        waves = self.scene.waves
        if waves is not None and hasattr(waves, "seed"):
            self.scene = self.scene.model_copy(update={"waves": waves.model_copy(update={"seed": int(seed)})})
            self.movers = self._movers()

    # -------------------------------------------------------------------------------------- the loop

    def run(self, until: float | None = None, on_step: Callable[[Simulation], None] | None = None) -> None:
        """Advance to `until` [s] (the scene's duration if not given); on_step is called after each step."""
        until = self.scene.duration if until is None else until
        self.begin()
        while self.time < until * (1 - 1e-12):
            self.step(until)
            if on_step:
                on_step(self)

    def begin(self) -> None:
        """Open the recorders; `run` and `step` do so where it has not been done."""
        if not self._recording:
            self._recording = True
            for recorder in self.recorders:
                recorder.begin(self.scene, self.bodies)

    def settle(self) -> None:
        """Let the water come to rest, where the scene starts so and it has not been done; the first step does so too."""
        if self._settled:
            return
        from fsi.simulation.settling import settle

        self._settled = True
        with self._phase("start"):
            dt = TimeStep(self.scene, self.fluid.depth).choose(0.0, self.scene.gravity)
            steps, speed = settle(self.fluid, self.bodies, dt)
        self.report("info", f"the water settled for {steps} steps before t = 0; at the end it moved at {speed:.2g} m/s")

    def close(self) -> None:
        """Stop the threads; the simulation can no longer step."""
        self.team.close()

    def step(self, until: float = math.inf) -> None:
        """One coupled step, in the order of the data."""
        self.begin()
        if self.step_count == 0:
            self.settle()
            self.balance.open()
        if self.step_count == 0 and self.bodies:
            self._speed = max(self._speed, self._stability.fastest_body())
        if self.control:
            until = min(until, self.control.act(self.time))
        dt = self.dt = to_reach(until, self.time, self._limits.choose(self._speed, self._acceleration))
        logged = [name for name, due in self._due.items() if self.time + dt >= due + self._interval(name) * 0.999]
        with self._phase("neighbours"):
            motion = self.movers.place(self.time, dt)
            self.fluid.begin(dt, motion.centre, motion.twist, motion.smooth)
        if self.step_count == 0:
            self._start(motion)
        with self._phase("predictor"):
            self.fluid.predict()
        with self._phase("pressure"):
            wrench = self._exchange(motion, dt)
        with self._phase("corrector"):
            if self.fluid.sea:
                self.fluid.sea.work(self.fluid)
            if "series" in logged and self.recorders:
                self.balance.open_audit()
                self.instruments.open()
            sums, impulse = self.fluid.correct()
            self.instruments.step(dt)
            if self.glue:
                self.glue.hold(sums, impulse)
            sums = self.balance.ordered(sums, "series" in logged and bool(self.recorders))
        self.time += dt
        self.step_count += 1
        self._close(sums, impulse, wrench, motion, dt)
        with self._phase("record"):
            for event in self._watch(
                self.now, dt, wrench[FIRST_BODY:, :3], self._limits.previous or dt, self._limits.reason
            ):
                self._tell(event)
            for name in logged:
                self._record(name)
        if self.ranks:
            self.ranks.after_step(self)

    def _start(self, motion: Motion) -> None:
        """Pressure at t = 0, and the first frame."""
        if start(self.scene) == "converged":
            with self._phase("start"):
                acceleration = np.zeros((self.fluid.owners, 6))
                acceleration[: len(motion.others)] = motion.others
                moving = self.fluid.boundary_velocity.copy()
                self.fluid.boundary_velocity[:] = 0.0  # what moves already sets the fluid going in the steps to come
                self.fluid.begin(self.dt, motion.centre, np.zeros_like(motion.twist))
                self.fluid.settle(acceleration)
                self.fluid.boundary_velocity[:] = moving
                self.fluid.begin(self.dt, motion.centre, motion.twist, motion.smooth)
        with self._phase("record"):
            for name in self._due:
                self._record(name)

    def _exchange(self, motion: Motion, dt: float) -> np.ndarray:
        """Pressure, and with it the motion of the bodies; the wrench (owners, 6) over the step."""
        if self.coupler is None:
            return self.fluid.pressure(motion.others)
        loads = BodyLoads(self.fluid, motion.others, self._stopped[FIRST_BODY:] / dt)
        try:
            settled = self.coupler.step(loads, self.bodies, self.time, dt)
        except RunError as fault:
            raise self._stability.failed(fault) from fault
        self.movers.follow()
        self._passes[:2] += loads.updates, loads.responses
        self._passes[2] = max(self._passes[2], loads.updates)
        wrench = self.fluid.wrench(viscous=True) if self.movers.piston else np.zeros((self.fluid.owners, 6))
        wrench[FIRST_BODY:] = settled
        return wrench

    def _close(self, sums, impulse, wrench, motion: Motion, dt: float) -> None:
        """Book the step and find out whether the run still stands."""
        new_twist = motion.twist + 0.0
        if self.movers.piston:
            new_twist[: len(motion.others)] += dt * motion.others
        if self.bodies:
            new_twist[FIRST_BODY:] = self.bodies.motion().velocity
        self.balance.close(sums, impulse, wrench, motion.twist, new_twist, dt)
        self._stopped = impulse
        self._speed = max(self.balance.max_speed, self.movers.speed())
        self._acceleration = math.sqrt(sums[corrector_sums(self.scene.dimension).acceleration2])
        finite = bool(np.isfinite(sums).all() and np.isfinite(wrench).all())
        before, after, load = (array[FIRST_BODY:] for array in (motion.twist, new_twist, wrench))
        self._stability.check(before, after, load, finite, self._speed)
        self.alarms.check(self._stability.kept)

    # -------------------------------------------------------------------------------------- watching

    @property
    def now(self) -> Moment:
        return Moment(self.time, self.step_count, clock.perf_counter() - self._began)

    def report(self, level: str, text: str) -> None:
        """An event now (`fsi.simulation.events`), for the recorders and `run.json`."""
        self._tell(Event(self.now, level, text))

    def finish(self, level: str, text: str) -> None:
        """The last events of a run: what was still going on, the warnings, and how it ended."""
        for event in self._watch.finish(self.now):
            self._tell(event)
        told = {event.text for event in self.events}
        for line in self.warnings:
            if line not in told:
                self.report("warning", line)
        self.report(level, text)

    def _tell(self, event: Event) -> None:
        self.events.append(event)
        for recorder in self.recorders:
            recorder.event(event)

    @contextmanager
    def _phase(self, name: str):
        start = clock.perf_counter()
        yield
        self.phases[name] += clock.perf_counter() - start

    def _interval(self, stream: str) -> float:
        interval = getattr(self.scene.output, stream)
        return interval if interval > 0 and self.recorders else math.inf

    def _record(self, stream: str) -> None:
        """Hand the state to the recorders; the next frame is due one interval on."""
        interval = self._interval(stream)
        if math.isinf(interval):
            return
        if self.step_count:
            self._due[stream] = interval * math.floor(self.time / interval + 1e-3)
        frame = Frame(*self.now)
        if stream == "series":
            frame.series = self.balance.series(self.instruments.series(self.time, self.balance.dt))
        else:
            seen = self.fluid.seen()
            frame.position, frame.velocity, frame.pressure, frame.label = (seen.pop(name) for name in self.fluid.SEEN)
            frame.fields = seen
        self._stability.logged = self.time
        for recorder in self.recorders:
            (recorder.series if stream == "series" else recorder.particles)(frame)

    @property
    def warnings(self) -> list[str]:
        """What the user should know of this run so far."""
        parts = self.bodies, self.coupler, self.alarms
        return self._notes + [note for part in parts if part for note in part.notes]

    @property
    def threads(self) -> int:
        return self.team.threads

    @property
    def counts(self) -> dict[str, int]:
        """Particles by kind; `body` holds the wavemaker and the bodies."""
        walls = int(self.fluid.of_owner(0).stop)
        return {"fluid": self.fluid.count, "wall": walls, "body": len(self.fluid.owner) - walls}

    @property
    def memory_bytes(self) -> int:
        return self.fluid.nbytes

    def coupling(self) -> dict:
        """How fluid and bodies were coupled, for `run.json`; empty without bodies. Passes are means per step;
        `added_mass_ratio` is the added over the own inertia of each body as last measured."""
        if self.bodies is None:
            return {}
        updates, responses = self._passes[:2] / max(self.step_count, 1)
        ratios = self.coupler.mass_ratio(self.bodies)
        return {
            "scheme": self.scene.coupler.scheme,
            "pressure_updates": updates,
            "most_pressure_updates": int(self._passes[2]),
            "linear_responses": responses,
            "added_mass_ratio": dict(zip(self.bodies.names, ratios.tolist(), strict=True))
            if ratios is not None
            else {},
        }

    def audit(self) -> dict:
        """Balance of energy and momentum and what was lost, for `run.json`."""
        return self.balance.audit() | self.alarms.audit()


def _team(threads: int | None) -> Team:
    try:
        return Team(threads)
    except RuntimeError as fault:  # a limit of the system, or of a container
        text = f"the system refuses {threads or available_threads()} threads: {fault}"
        raise SceneError(text, key="--threads", fix="use fewer, or raise the limit of processes (ulimit -u)") from None


def _built(scene: Scene, bodies: BodySet | None, coupler: Coupler | None, ground: Solid | None) -> tuple:
    """Bodies, coupler and ground: those given, the rest as the scene says."""
    if (bodies is None) != (coupler is None):
        raise SceneError("bodies and coupler come together", key="bodies", fix="give both to Simulation, or neither")
    if (scene.bodies and bodies is None) or (scene.tank.bathymetry and ground is None):
        own = bind(scene, scene.name, bodies=bodies is None, ground=ground is None)
        bodies, coupler, ground = (
            mine if mine is not None else given for mine, given in zip(own, (bodies, coupler, ground), strict=True)
        )
    return bodies, coupler, ground
