"""The instruments of a scene: what they read at a logged instant."""

from __future__ import annotations

import numpy as np

from fsi.errors import SceneError
from fsi.fluid.gauges import Surface, points_reading, pressure_at, row_reading
from fsi.particles.instruments import ON_FACE
from fsi.protocols import BodySet
from fsi.scene.model import Gauge, Probe, Scene
from fsi.state import Remembers


class Instruments(Remembers):
    """All instruments of a scene. Raises SceneError where a probe rides on what does not move or is not there."""

    remembered = ("discharge",)

    def __init__(self, scene: Scene, fluid, bodies: BodySet | None):
        self.scene, self.fluid, self.bodies = scene, fluid, bodies
        self._surface = Surface(fluid)
        self._axes = [0, 2] if fluid.dim == 2 else [0, 1, 2]
        self._riders = {n: _Rider(n, p, bodies, self._axes) for n, p in scene.probes.items() if p.body or p.site}
        self._check_riders()
        self.discharge = self._depths = None
        self._shores, self._floods = (), ()
        if scene.fluxes or scene.runups or scene.areas or scene.depths:
            self._make_currents()

    def _check_riders(self) -> None:
        """Raise SceneError for a site within a solid, where no fluid can come."""
        solids = [solid for _, solid in self.bodies.solids()] if self._riders else []
        for name, rider in self._riders.items():
            depth = -min(float(solid.clearance(rider.place()[None])[0]) for solid in solids)
            if depth > ON_FACE * self.scene.spacing:
                fault = f"the site is {depth:.3g} m inside a solid, where no fluid can come"
                raise SceneError(fault, key=f"probes.{name}.site", fix="move it to the face of its body")

    def _make_currents(self) -> None:
        from fsi.fluid.currents import Columns, Discharge, Flood, Shore

        scene = self.scene
        self.discharge = Discharge(scene) if scene.fluxes else None
        if scene.depths:
            self._depths = Columns(scene, np.array([_foot(g, self.fluid.dim) for g in scene.depths.values()]))
        self._shores = [Shore(scene, line) for line in scene.runups.values()]
        self._floods = [Flood(scene, area) for area in scene.areas.values()]

    def open(self) -> None:
        """Called in a step that is logged, after its pressure is final and before the corrector."""
        if self.fluid.loads is not None:
            self.fluid.loads.open(self.fluid)

    def step(self, dt: float) -> None:
        """Called after the corrector of every step."""
        if self.discharge is not None:
            fluid = self.fluid
            self.discharge.step(fluid.position, fluid.velocity, dt, fluid.reductions)

    def elevations(self) -> dict[str, float]:
        """Elevation [m] above still water at each gauge, nan where there is no water."""
        level = self.scene.fluid.still_water_level
        return {name: self._elevation(gauge) - level for name, gauge in self.scene.gauges.items()}

    def pressures(self) -> dict[str, float]:
        """Pressure [Pa] at each probe."""
        return {name: self._pressure(name, probe) for name, probe in self.scene.probes.items()}

    def series(self, time: float, dt: float) -> dict:
        """Readings at `time` [s], after a step of dt [s]; 0 before the first one."""
        fluid, scene = self.fluid, self.scene
        out: dict = {}
        if scene.gauges:
            out["elevation"] = np.array(list(self.elevations().values()))
        if scene.probes:
            out["pressure"] = np.array(list(self.pressures().values()))
        if scene.velocimeters:
            out["velocity"] = np.array(
                [self._velocity(place) for m in scene.velocimeters.values() for place in m.places]
            )
        if self._depths or self._shores or self._floods:
            own = self._own()
        if self._depths:
            out["layer_thickness"] = self._depths(own, fluid.reductions)[0]
        if self._shores:
            read = np.array([shore(own, fluid.reductions) for shore in self._shores])
            out |= {"runup_distance": read[:, 0], "runup_height": read[:, 1]}
        if self._floods:
            read = np.array([flood(own, fluid.reductions) for flood in self._floods])
            out |= {"wet_area": read[:, 0], "inundation_depth": read[:, 1]}
        if self.discharge is not None:
            out |= self.discharge.read(time)
        if fluid.loads is not None:
            out |= fluid.loads.measure(dt) if dt > 0 else fluid.loads.nothing()
        return out

    def _own(self) -> np.ndarray:
        """Positions without the ghosts of the first frame in a periodic tank."""
        return self.fluid.position[self.fluid.particles.own]

    def _near(self, point, reach: float, *values) -> list[np.ndarray]:
        """Positions and values of at least all particles within reach of a point or a vertical; in a periodic tank each as its
        image that is nearest to it."""
        fluid, tank = self.fluid, self.scene.tank
        found = list(fluid.reductions.around(point, reach, fluid.position, *values))
        if not tank.periodic:
            return found
        if found[0] is fluid.position:
            found = [array[fluid.particles.own] for array in found]
        found[0] = found[0].copy()
        for d, axis in enumerate(tank.axes[: len(point)]):
            if axis in tank.periodic:
                length = tank.max[d] - tank.min[d]
                found[0][:, d] -= length * np.round((found[0][:, d] - point[d]) / length)
        return found

    def _elevation(self, gauge: Gauge) -> float:
        place, scene = _foot(gauge, self.fluid.dim), self.scene
        if gauge.reading == "surface":
            return self._surface(place)
        h, spacing = scene.reading_length, scene.spacing
        (position,) = self._near(place, 2 * h)
        if gauge.reading == "points":
            return points_reading(position, place, spacing, h)
        return row_reading(position, place, spacing, self._surface(place))

    def _pressure(self, name: str, probe: Probe) -> float:
        fluid, scene, h = self.fluid, self.scene, self.scene.reading_length
        weight = scene.fluid.density * scene.gravity
        point = self._riders[name].place() if name in self._riders else probe.position
        return pressure_at(*self._near(point, 2 * h, fluid.pressure_values), np.array(point), h, weight)

    def _velocity(self, place) -> np.ndarray:
        from fsi.fluid.currents import velocity_at

        fluid, h, out = self.fluid, self.scene.reading_length, np.zeros(3)
        near = self._near(place, 2 * h, fluid.velocity)
        out[self._axes] = velocity_at(*near, place, self.scene.spacing, h)
        return out


class _Rider:
    """A place that moves with a body."""

    def __init__(self, name: str, probe: Probe, bodies: BodySet, axes: list[int]):
        if probe.site is not None:
            found = bodies.site(probe.site)
            if found is None:
                fix = "name a site of a moving wet body, with `FILE/` before it where there are several body files"
                raise SceneError(f"no moving wet body has a site {probe.site!r}", key=f"probes.{name}.site", fix=fix)
            self._body, point = found
        else:
            if probe.body not in bodies.names:
                fix = f"known are {', '.join(bodies.names) or 'none'}"
                raise SceneError(f"no moving wet body {probe.body!r}", key=f"probes.{name}.body", fix=fix)
            self._body, point = bodies.names.index(probe.body), np.zeros(3)
            point[axes] = probe.position
        self._bodies, self._axes = bodies, axes
        motion = bodies.motion()
        self._arm = (point - motion.position[self._body]) @ motion.rotation[self._body]  # in the frame of the body

    def place(self) -> np.ndarray:
        """Where it is now (dim,) [m]."""
        motion = self._bodies.motion()
        return (motion.position[self._body] + motion.rotation[self._body] @ self._arm)[self._axes]


def _foot(gauge, dim: int) -> tuple[float, ...]:
    return (gauge.x,) if dim == 2 else (gauge.x, gauge.y)
