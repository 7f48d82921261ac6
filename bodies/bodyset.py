"""The rigid bodies of a scene, moved by MuJoCo."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from bodies import checks, messages, pto, sensors, sizes
from bodies.assets import assets
from bodies.conditions import conditions
from bodies.flooded import Held, held
from bodies.geoms import place, triangles
from bodies.mjcf import GEOM, for_looks, load_model, moves, name_of, wet_geoms
from bodies.moorings import moorings_of
from bodies.reach import Reach
from bodies.roundness import Roundness, roundness
from bodies.settings import check_settings
from bodies.shapes.gap import Gap, between
from bodies.shapes.primitives import Placed
from bodies.stepper import Stepper
from bodies.world import start_from_keyframes
from fsi.errors import SceneError
from fsi.owners import FIRST_BODY, WALL
from fsi.protocols import BodyMotion, Visual
from fsi.scene.model import Scene

BODY, JOINT, ACTUATOR = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_ACTUATOR
MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
SINGLE = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def load(scene: Scene, source: object = "scene.toml") -> BodySet:
    """The bodies of a scene, checked against its spacing and tank. Raises SceneError, which calls it `source`."""
    return BodySet(scene, source)


class BodySet:
    """Implements `fsi.protocols.BodySet`.

    A boundary particle of a body is carried by its position relative to the centre of mass in the frame of the body:
    r = rotation.T @ (x - position) at the start, x = position + rotation @ r afterwards, with those of `motion()`; round
    bodies are carried without their spin (`bodies.roundness`).
    In two dimensions the fluid acts on the components x, z and pitch of wrench and twist only.
    """

    def __init__(self, scene: Scene, source: object = "scene.toml"):
        self.dimension, self._source = scene.dimension, source
        self._spacing, self._layers = scene.spacing, scene.layers
        self.model, starts, weighed, notes = load_model(scene.bodies, scene.gravity, source)
        self.data = mujoco.MjData(self.model)
        self._motion: tuple[list[bytes] | None, BodyMotion | None] = (None, None)
        start_from_keyframes(self.model, self.data, starts)
        model = self.model
        geoms = wet_geoms(model, scene.bodies, source)
        notes += (looks := for_looks(model, scene.bodies, geoms)).values()
        sizes.check_model(model, geoms, scene, source)
        self._scene = scene
        self._bodies = self.ids = np.array(
            sorted({model.geom_bodyid[g] for g in geoms if moves(model, model.geom_bodyid[g])}), int
        )
        notes += check_settings(model, self.data, self._bodies, scene, source)
        checks.check_driven(model, geoms, source)
        self.names = tuple(name_of(model, BODY, b) for b in self._bodies)
        self._dry = np.array([b for b in range(model.nbody) if moves(model, b) and b not in self._bodies], int)
        self.dry_names = tuple(name_of(model, BODY, b) for b in self._dry)
        self.mass = model.body_mass[self._bodies].copy()
        checks.check_mass(self.names, self.mass, source)
        self._joints = np.flatnonzero(np.isin(model.jnt_type, SINGLE))
        self.joint_names = tuple(name_of(model, JOINT, j) for j in self._joints)
        self.joint_is_rotary = tuple(bool(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE) for j in self._joints)
        self.joint_dof = model.jnt_dofadr[self._joints].astype(int)  # (joints,) index into joint accelerations (nv,)
        joints = dict(zip(self.joint_names, self._joints, strict=True))
        self._ptos = pto.by_joint(model, scene.bodies, joints, source)
        notes += self._ptos.notes
        self.files = tuple(file for one in scene.bodies.values() for file in assets(one.mjcf))
        self._stepper = Stepper(model, self.data, self._ptos, scene.coupler.tolerance, plane=self.dimension == 2)
        self._moorings = self._stepper.moorings = moorings_of(model, self.data, scene, source)
        notes += self._moorings.slack(self.data) if self._moorings else []
        self.mooring_names = self._moorings.names if self._moorings else ()
        sizes.check_independent(model, self.inertia(), source)
        self.sensor_names = sensors.names(model)
        self.actuator_names = tuple(name_of(model, ACTUATOR, a) for a in range(model.nu))
        self._round: dict[int, Roundness] = {}
        self._solids, labels, said = self._make_solids(geoms, weighed)
        if any(file.start == "equilibrium" for file in scene.bodies.values()):
            notes += self._start_at_rest(scene)
            self._solids, labels, said = self._make_solids(geoms, weighed)
        notes += said
        notes += checks.check_inside(self._solids, labels, self.names, scene, source, looks)
        self._gaps = self._make_gaps(scene, geoms, source)
        self.insides: dict[int, list[Held]] = {}  # body -> its inside, where it starts dry
        self._held, said = self._make_held(scene)
        notes += said
        self._round = self._find_round(geoms)
        grain = (scene.spacing, scene.layers)
        notes += checks.check_solids(self._solids, labels, self.names, self.motion().rotation, *grain, source)
        notes += checks.lift(self._solids, labels, scene)
        checks.check_contacts(model, self.data, scene.spacing, source)
        self._reach = Reach(model, [g for g in geoms if moves(model, model.geom_bodyid[g])], scene)
        notes += self._reach.ranges()
        if self.dimension == 2:
            notes += self._check_width(geoms, scene.tank.width)
        self._notes = tuple(notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided for the user, up to now."""
        steps = (*self._stepper.notes.values(), *self._stepper.penetration.notes, *self._reach.notes)
        return self._notes + steps + tuple(messages.of_run(self.data))

    @property
    def unsettled(self) -> int:
        """Substeps so far in which the added inertia did not settle to the coupler's tolerance."""
        return self._stepper.unsettled

    def penetration(self) -> tuple[dict[str, float], float]:
        """How far each limited joint went beyond its range [m, rad], and the deepest contact [m], so far."""
        return self._stepper.penetration.limits(), self._stepper.penetration.depth

    def solids(self) -> list[tuple[int, Placed]]:
        """(owner, solid) for every wet geom in its initial pose: owner 0 is a fixed wall, 2 + b the b-th body; and for the
        inside of bodies that start dry."""
        return [*self._solids, *((0, held) for held in self._held)]

    def gaps(self) -> list[tuple[int, Gap]]:
        """(owner, gap) for every body with fluid glued to it."""
        return list(self._gaps)

    def motion(self) -> BodyMotion:
        """Poses, twists and jacobians of the wet bodies at their centres of mass, see `BodyMotion`; found once a state."""
        data = self.data
        state = [a.tobytes() for a in (data.qpos, data.qvel, data.xipos, data.xmat, data.cdof, data.cvel)]
        if state != self._motion[0]:
            self._motion = state, self._find_motion()
        return self._motion[1]

    def _find_motion(self) -> BodyMotion:
        model, data, count = self.model, self.data, len(self._bodies)
        jacobian, rate = np.zeros((count, 6, model.nv)), np.zeros((count, 6, model.nv))
        for b, body in enumerate(self._bodies):
            centre = data.xipos[body]
            mujoco.mj_jacBodyCom(model, data, jacobian[b, :3], jacobian[b, 3:], body)
            mujoco.mj_jacDot(model, data, rate[b, :3], rate[b, 3:], centre, body)
        return BodyMotion(
            position=data.xipos[self._bodies].copy(),
            rotation=data.xmat[self._bodies].reshape(-1, 3, 3).copy(),
            velocity=jacobian @ data.qvel,
            jacobian=jacobian,
            bias=rate @ data.qvel,
            **self._without_spin(),
        )

    def _without_spin(self) -> dict[str, np.ndarray]:
        """What `BodyMotion` adds where a body is round."""
        if not self._round:
            return {}
        rotation = self.data.xmat[self._bodies].reshape(-1, 3, 3)
        smooth = np.tile(np.eye(6), (len(rotation), 1, 1))
        turn, pivot = rotation.copy(), np.zeros((len(rotation), 3))
        for b, body in self._round.items():
            smooth[b], turn[b], pivot[b] = body.smooth(rotation[b]), body.turn(rotation[b]), body.centre
        return {"smooth": smooth, "turn": turn, "pivot": pivot}

    def inertia(self) -> np.ndarray:
        """Mass matrix (nv, nv) of the joints, armature included [kg, kg m, kg m2]."""
        return self._stepper.inertia()

    def dry_poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Position (d, 3) [m] of the centre of mass and rotation (d, 3, 3) of the bodies in `dry_names`."""
        return self.data.xipos[self._dry].copy(), self.data.xmat[self._dry].reshape(-1, 3, 3).copy()

    def conditions(self) -> list[str]:
        """What holds now, in words: joints at a limit, contacts, bodies in walls of the tank."""
        return conditions(self.model, self.data) + self._reach.conditions()

    def energy(self) -> float:
        """Kinetic plus potential energy of everything MuJoCo moves, springs included [J]."""
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy.sum())

    def joints(self) -> dict[str, np.ndarray]:
        """Series of the hinge and slide joints, each (joints,), in rad and N m or m and N.

        `joint_force` is what spring, damper, actuators and power take-off exert along the joint; limits, the file's
        own friction and the fluid are not in. `pto_power` [W] is what damper, actuators and power take-off take out of the
        motion; a power take-off's spring counts, which gives back what it takes.
        """
        data, dof = self.data, self.joint_dof
        velocity = data.qvel[dof]
        drive = data.qfrc_actuator[dof] + self._ptos.force[dof]
        return {
            "joint_position": data.qpos[self.model.jnt_qposadr[self._joints]],
            "joint_velocity": velocity,
            "joint_force": data.qfrc_spring[dof] + data.qfrc_damper[dof] + drive,
            "pto_power": -(data.qfrc_damper[dof] + drive) * velocity,
        }

    def advance(self, dt: float, wrench: np.ndarray, added_inertia: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Step the bodies by dt [s] under the wrench (b, 6) about their centres of mass, which holds at the joint
        acceleration `acceleration` (nv,) and falls by `added_inertia` (nv, nv) for each unit above it.
        Returns the mean joint acceleration (nv,), change of `qvel` over dt; see `bodies.stepper`."""
        acceleration = self._stepper.advance(dt, self._bodies, wrench, added_inertia, acceleration)
        self._reach.watch(self.data)
        return acceleration

    def sensors(self, wrench: np.ndarray) -> dict[str, np.ndarray]:
        """`sensor_reading` (sensors,) of the MJCF file's sensors under the fluid's wrench (b, 6), hinge reactions among them;
        empty for a file without any."""
        return {"sensor_reading": self._stepper.sense(self._bodies, wrench)} if self.sensor_names else {}

    def controls(self) -> dict[str, np.ndarray]:
        """`control` and `actuator_force`, each (actuators,), over the last step; empty for a file without actuators."""
        data = self.data
        return {"control": data.ctrl.copy(), "actuator_force": data.actuator_force.copy()} if self.model.nu else {}

    def moorings(self) -> dict[str, np.ndarray]:
        """`mooring_tension` (moorings,) [N] at the fairleads, where the bodies stand; empty for a scene without lines."""
        return {"mooring_tension": self._moorings.tensions(self.data)} if self._moorings else {}

    def expose(self, wrench: np.ndarray) -> None:
        """Give `data` the sensor readings and the joint accelerations of `mj_forward` under the fluid's wrench (b, 6). No step
        to come depends on them."""
        self._stepper.expose(self._bodies, wrench)

    def state(self) -> dict:
        """The whole state, for `restore`; bit for bit. What a user's function of a power take-off remembers is not in."""
        return self._stepper.state() | {"reach": self._reach.state()}

    def restore(self, state: dict) -> None:
        """Go back to a state. Raises ValueError where it is one of other bodies."""
        self._stepper.restore(state)
        self._reach.restore(state["reach"])

    def place(self, position: dict[str, float], velocity: dict[str, float]) -> None:
        """Set the named hinge and slide joints [rad, m and 1/s of it]; the rest stays as it is."""
        for name, value in position.items():
            self.data.qpos[self.model.jnt_qposadr[self._joint(name)]] = value
        for name, value in velocity.items():
            self.data.qvel[self.model.jnt_dofadr[self._joint(name)]] = value
        self._stepper.refresh()

    def site(self, name: str) -> tuple[int, np.ndarray] | None:
        """Number of the wet body that has this site, and where it is now (3,) [m]; None where no moving wet body has it."""
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, name)
        if found < 0 or (body := self.model.site_bodyid[found]) not in self._bodies:
            return None
        return int(np.searchsorted(self._bodies, body)), self.data.site_xpos[found].copy()

    def visuals(self) -> list[Visual]:
        """Triangle meshes of all geoms, see `Visual`. Vertices are relative to the centre of mass in the frame of the
        body, so that world = position + rotation @ vertex with `motion()` or `dry_poses()`."""
        model, data = self.model, self.data
        shown = []
        for geom in range(model.ngeom):
            body = model.geom_bodyid[geom]
            surface = triangles(model, geom)
            if surface is None:
                continue
            vertices = surface[0] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            owner = ""
            if moves(model, body):
                owner = name_of(model, BODY, body)
                vertices = (vertices - data.xipos[body]) @ data.xmat[body].reshape(3, 3)
            colour = tuple(round(255 * c) for c in _colour(model, geom))
            shown.append(Visual(name_of(model, GEOM, geom), owner, vertices, surface[1], colour))
        return shown

    def hydrostatics(self) -> dict[str, dict[str, dict[str, float]]]:
        """How each wet body floats in still water, `drawn`, and at `rest` where there is such a pose (`bodies.floating.facts`);
        empty in a tank that is not filled with one liquid to its still water level."""
        from bodies.floating import facts

        scene = self._scene
        if not self.names or scene.fluid.blocks or scene.liquids or not scene.gravity:
            return {}
        water = self._floating(scene)
        found = {name: {"drawn": drawn} for name, drawn in facts(water, self).items()}
        if scene.coupler.scheme == "prescribed":
            return found
        place = water.settle(self._still_forces, ~self._stepper.fixed, _height(scene))
        if place is not None:
            drawn, moved = self.data.qpos.copy(), self.motion().position[:, 2]
            self._pose(place)
            for name, rest, rise in zip(
                found, facts(water, self).values(), self.motion().position[:, 2] - moved, strict=True
            ):
                found[name]["rest"] = rest | {"rise": float(rise)}
            self._pose(drawn)
        return found

    def restoring(self) -> tuple[np.ndarray, tuple[str, ...]]:
        """How the forces of still water, springs and mooring lines on the joints fall with their positions (nv, nv), where the
        bodies stand, and a name for each degree of freedom: of its joint, of a free one `BODY surge` and so on, "" for one that
        leads out of the plane."""
        names = []
        for dof, joint in enumerate(self.model.dof_jntid):
            free = self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
            name = name_of(self.model, BODY, self.model.dof_bodyid[dof]) if free else name_of(self.model, JOINT, joint)
            way = f" {MOTIONS[dof - self.model.jnt_dofadr[joint]]}" if free else ""
            names.append("" if self._stepper.fixed[dof] else f"{name}{way}")
        return self._floating(self._scene).stiffness(self._still_forces), tuple(names)

    def buoyancy(self) -> Callable[[], np.ndarray]:
        """A function that gives the wrench (b, 6) of still water about the centres of mass, where the bodies stand when it is
        called."""
        water = self._floating(self._scene)
        return lambda: water.wrenches(self.motion())

    def _floating(self, scene: Scene):
        from bodies.floating import Floating

        width = scene.tank.width if self.dimension == 2 else None
        return Floating(self, self.insides, scene.fluid.density, scene.fluid.still_water_level, width)

    def _still_forces(self, data: mujoco.MjData) -> np.ndarray:
        """Joint forces (nv,) besides those of the file, of bodies at rest."""
        force = self._ptos.at_rest(data)
        return force + self._moorings.forces(data)[0] if self._moorings else force

    def _pose(self, place: np.ndarray) -> None:
        self.data.qpos[:] = place
        self._stepper.refresh()

    def _start_at_rest(self, scene: Scene) -> list[str]:
        """Put the bodies of the files that start at their equilibrium there; notes on where that is."""
        wanted = [key for key, file in scene.bodies.items() if file.start == "equilibrium"]
        self._gaps, self.insides, self._held = [], {}, []
        self._held, _ = self._make_held(scene)
        moving = ~self._stepper.fixed
        for dof, body in enumerate(self.model.dof_bodyid):
            own = name_of(self.model, BODY, body).partition("/")[0] if len(scene.bodies) > 1 else wanted[0]
            moving[dof] &= own in wanted
        place = self._floating(scene).settle(self._still_forces, moving, _height(scene))
        if place is None:
            fix = '`fsi check` with start = "drawn" tells their masses and drafts; a body that sinks needs something to rest on'
            raise SceneError("the bodies find no rest", key=f"bodies.{wanted[0]}.start", file=self._source, fix=fix)
        before = self.motion().position.copy()
        self._pose(place)
        rises = zip(self.names, self.motion().position[:, 2] - before[:, 2], strict=True)
        return [
            f"body {name!r} starts at rest, {abs(rise):.3g} m {'above' if rise > 0 else 'below'} where it is drawn"
            for name, rise in rises
            if abs(rise) > 1e-9
        ]

    def _joint(self, name: str) -> int:
        if name not in self.joint_names:
            known = ", ".join(self.joint_names) or "none"
            fault, fix = f"no hinge or slide joint {name!r}", f"known: {known}"
            raise SceneError(fault, key="bodies", file=self._source, fix=fix)
        return self._joints[self.joint_names.index(name)]

    def _make_solids(
        self, geoms: list[int], weighed: set[str]
    ) -> tuple[list[tuple[int, Placed]], list[str], list[str]]:
        """Solids of the wet geoms, each trimmed by the earlier ones of its owner, their names, and notes."""
        solids, labels, notes = [], [], []
        for geom in geoms:
            body, label = self.model.geom_bodyid[geom], name_of(self.model, GEOM, geom)
            moving = moves(self.model, body)
            owner = FIRST_BODY + int(np.searchsorted(self._bodies, body)) if moving else WALL
            heavy = moving and label in weighed
            parts, said = place(self.model, self.data, geom, self.dimension, heavy, self._source)
            notes += said
            for solid in parts:
                solid.name = label
                solid.others = tuple(other for its_owner, other in solids if its_owner == owner)
                solids.append((owner, solid))
                labels.append(label)
        return solids, labels, notes

    def _make_gaps(self, scene: Scene, geoms: list[int], source: object) -> list[tuple[int, Gap]]:
        """The glued layers that the scene asks for. Contacts keep the bodies that far from what they touch."""
        gaps = []
        walls = [solid for owner, solid in self._solids if owner == WALL]
        for key, file in scene.bodies.items():
            prefix = f"{key}/" if len(scene.bodies) > 1 else ""
            own = [b for b, name in enumerate(self.names) if name.startswith(prefix)] if file.glued_layers else []
            for b in own:
                solids = [solid for owner, solid in self._solids if owner == FIRST_BODY + b]
                layers, name = file.glued_layers, f"bodies.{key}.glued_layers"
                gaps.append((FIRST_BODY + b, between(solids, walls, scene.spacing, layers, scene.layers, name, source)))
                for geom in geoms:
                    if self.model.geom_bodyid[geom] == self._bodies[b]:
                        self.model.geom_margin[geom] = file.glued_layers * scene.spacing
        return gaps

    def _make_held(self, scene: Scene) -> tuple[list[Held], list[str]]:
        """The insides of open bodies that the scene wants dry, and notes on those that hold water."""
        found, notes = [], []
        for key, file in scene.bodies.items():
            prefix, wanted = f"{key}/" if len(scene.bodies) > 1 else "", len(found)
            for b, name in enumerate(self.names):
                own = [solid for owner, solid in self._solids if owner == 2 + b] if name.startswith(prefix) else []
                if (inside := held(own, scene)) is None:
                    continue
                if file.dry_inside:
                    found.append(inside)
                    self.insides[b] = [inside]
                    continue
                size = f"{inside.volume:.3g} {'m2' if self.dimension == 2 else 'm3'}"
                fix = f"set bodies.{key}.dry_inside = true to leave it out"
                notes.append(f"body {name!r} starts with {size} of water inside, cut off from the rest; {fix}")
            if file.dry_inside and len(found) == wanted:
                notes.append(f"bodies.{key}.dry_inside has no effect: the body holds no water at the start")
        return found, notes

    def _find_round(self, geoms: list[int]) -> dict[int, Roundness]:
        """The round bodies by number; fluid that is glued to one turns with it, so that it does not count."""
        glued, found = {owner - 2 for owner, _ in self._gaps}, {}
        for b, body in enumerate(self._bodies):
            own = [geom for geom in geoms if self.model.geom_bodyid[geom] == body]
            if b not in glued and (shape := roundness(self.model, self.data, body, own, self.dimension)):
                found[b] = shape
        return found

    def _check_width(self, geoms: list[int], width: float) -> list[str]:
        """Notes on bodies whose extent along y is not the width [m] that a two-dimensional scene stands for."""
        notes = []
        for name, body in zip(self.names, self._bodies, strict=True):
            ends = [self._across(geom) for geom in geoms if self.model.geom_bodyid[geom] == body]
            extent = max(high for _, high in ends) - min(low for low, _ in ends)
            if abs(extent - width) > 0.01 * width:
                notes.append(
                    f"body {name!r} is {extent:g} m wide along y, the fluid that acts on it {width:g} m (tank.width)"
                )
        return notes

    def _across(self, geom: int) -> tuple[float, float]:
        y_axis, y = self.data.geom_xmat[geom].reshape(3, 3)[1], self.data.geom_xpos[geom, 1]
        across = triangles(self.model, geom)[0] @ y_axis + y
        return float(across.min()), float(across.max())


def _height(scene: Scene) -> float:
    """Of the tank [m]."""
    return scene.tank.max[-1] - scene.tank.min[-1]


def _colour(model: mujoco.MjModel, geom: int) -> np.ndarray:
    material = model.geom_matid[geom]
    return model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
