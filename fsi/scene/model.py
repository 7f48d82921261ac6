"""A scene: everything that defines a run, as frozen and validated values with every default visible.

SI units; z is up and z = 0 is the still water level unless `fluid.still_water_level` says otherwise. In two dimensions
points are (x, z), in three (x, y, z). A scene says what is there; `fsi.particles.layout` turns it into particles.

Values are checked here one by one, against each other in `fsi.scene.check`.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticKnownError

from fsi.parts import FilePath, NonNegative, Number, Part, Point, Positive, Side
from fsi.scene.coupler import AnyCoupler, CouplerSettings
from fsi.scene.fields import FIELDS, known_fields
from fsi.scene.instruments import Area, DepthGauge, FluxPlane, Gauge, Load, Probe, RunUp, Velocimeter
from fsi.scene.numerics import Numerics, wave_numerics
from fsi.scene.polygon import crossing_sides
from fsi.scene.rheology import Rheology
from fsi.scene.waves import DampingZone, Sea, Waves


class Box(Part):
    """An axis-aligned box from `min` to `max` [m]."""

    min: Point
    max: Point

    @model_validator(mode="after")
    def _ordered(self):
        if len(self.min) != len(self.max):
            raise ValueError(f"min has {len(self.min)} and max {len(self.max)} components; give both the same number")
        if any(a >= b for a, b in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on every axis; swap them")
        return self


GRIDS = (".xyz", ".asc", ".tif", ".tiff")  # suffixes of files of heights


class Grid(Part):
    """Where a bathymetry that is a grid of heights (XYZ, ASC, GeoTIFF) lies in the tank."""

    origin: tuple[Number, Number] = (0.0, 0.0)  # of the tank, x = y = 0, in the file's coordinates [m]
    direction: Number = 0.0  # of the tank's x axis, anticlockwise from the file's x axis [degrees]
    level: Number = 0.0  # height in the file of the tank's z = 0 [m]
    depths: bool = False  # the file holds depths, positive downwards
    missing: Number | None = None  # what the file would hold where it has no data [m]; None: refused inside the tank


class Tank(Box):
    """The box that holds the fluid, walled on `walls`; a particle that leaves it is counted as lost."""

    walls: tuple[Side, ...] = ("x-", "x+", "y-", "y+", "z-")
    open: tuple[Side, ...] = ()  # sides without a wall; fluid that leaves by them is removed and counted, not lost
    periodic: tuple[Literal["x", "y", "z"], ...] = ()  # axes along which the tank repeats itself; no walls across them
    boundary: Literal["auto", "layers", "single_layer"] = "auto"  # layers fill the support; one layer counts by weights
    bathymetry: FilePath | None = None  # mesh (STL, OBJ, PLY) whose inside is solid ground, or grid (XYZ, ASC, GeoTIFF)
    grid: Grid | None = None  # where a bathymetry that is a grid lies
    width: Positive = 1.0  # extent along y that a two-dimensional scene stands for [m]

    @property
    def axes(self) -> str:
        """Names of the axes in the order of the coordinates."""
        return "xyz" if len(self.min) == 3 else "xz"


class Block(Box):
    """Fluid at the start, with a uniform velocity [m/s]: what is inside the box from `min` to `max` and inside the polygon or
    the mesh, where there is one. With a polygon, in two dimensions, min and max may be left out."""

    model_config = ConfigDict(json_schema_extra=lambda schema: schema.pop("required", None))

    polygon: tuple[tuple[Number, Number], ...] = ()  # corners [x, z] in turn [m]; in three dimensions extruded along y
    mesh: FilePath | None = None  # closed mesh (STL, OBJ, PLY); in two dimensions its section y = 0
    angle: Annotated[float, Field(ge=-90, le=90)] | None = (
        None  # of a lattice of its own along a slope that rises at this angle to the x axis [deg]; None: the tank's
    )
    velocity: tuple[Number, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _tight(cls, values):
        """Close the box around the polygon."""
        corners = values.get("polygon") if isinstance(values, dict) else None
        if not corners:
            return values
        try:
            low, high = ([pick(corner[d] for corner in corners) for d in (0, 1)] for pick in (min, max))
            given = [list(values.get("min", low)), list(values.get("max", high))]
            box = [[*map(float, side)] for side in given]
            for d, n in ((0, 0), (-1, 1)):
                box[0][d], box[1][d] = max(box[0][d], low[n]), min(box[1][d], high[n])
        except (TypeError, ValueError, IndexError, KeyError):  # told of at the values themselves
            return {"min": (0.0, 0.0), "max": (1.0, 1.0)} | values
        return values | {"min": box[0], "max": box[1]}

    @model_validator(mode="after")
    def _one_shape(self):
        if self.polygon and self.mesh:
            raise ValueError("has a polygon and a mesh; remove one of them")
        if self.polygon:
            if len(self.polygon) < 3:
                raise ValueError(f"a polygon of {len(self.polygon)} corners has no inside; give three or more")
            if met := crossing_sides(self.polygon):
                raise ValueError(f"sides {met[0]} and {met[1]} of the polygon cross or touch; give its corners in turn")
        return self


class Liquid(Part):
    """A liquid, and the blocks of it at t = 0."""

    density: Positive = 1000.0  # [kg/m3]
    kinematic_viscosity: NonNegative = 1e-6  # [m2/s]
    rheology: Rheology | None = None  # in place of kinematic_viscosity
    blocks: tuple[Block, ...] = ()

    @model_validator(mode="after")
    def _one_viscosity(self):
        if self.rheology and self.kinematic_viscosity != 1e-6:
            raise ValueError("has a kinematic_viscosity and a rheology; remove one of them")
        return self


class Fluid(Liquid):
    """The main liquid. Without blocks, it fills the tank up to `still_water_level`, around the blocks of the others."""

    still_water_level: Number = 0.0  # [m]
    acceleration: tuple[Number, ...] | None = None  # of all fluid, besides gravity, such as a pressure gradient / rho
    acceleration_gradient: tuple[tuple[Number, ...], ...] | None = None  # G [1/s2] of a further acceleration G x at x
    start: Literal["auto", "hydrostatic", "converged", "zero", "settled"] = (
        "auto"  # pressure at t = 0, or water that comes to rest before; auto: converged where a block has a free side face,
        # settled where still water meets a bathymetry or fixed wet geoms, hydrostatic elsewhere
    )


class LinearPto(Part):
    """Power take-off: spring and damper along a joint."""

    kind: Literal["linear"] = "linear"
    damping: NonNegative = 0.0  # [N s/m], of a hinge [N m s/rad]
    stiffness: Number = 0.0  # [N/m], of a hinge [N m/rad]; below zero for a reactive control
    rest: Number = 0.0  # joint position without spring force [m, rad]


class LatchingPto(LinearPto):
    """Spring and damper that hold the joint for a while whenever it comes to rest."""

    kind: Literal["latching"]
    hold: Positive  # [s]
    least_speed: Positive = 1e-3  # that a swing must have reached for its end to be held [m/s, rad/s]


class CoulombPto(Part):
    """Power take-off of constant force against the motion; it holds the joint as long as less than that drives it."""

    kind: Literal["coulomb"]
    force: Positive  # [N], of a hinge [N m]


class TablePto(Part):
    """Power take-off of a force that depends on velocity, from a table: columns velocity [m/s, rad/s] and force on the
    joint [N, N m], commas, a header line; beyond its ends the outermost slopes go on."""

    kind: Literal["table"]
    file: FilePath


class PythonPto(Part):
    """Power take-off of a user's own: `FILE.py:NAME` is a function of time, joint position and velocity that returns the
    force on the joint. It is called several times a step, and must give the same answer each time."""

    kind: Literal["python"]
    function: FilePath


def _pto_kind(pto) -> str | None:
    return pto.get("kind", "linear") if isinstance(pto, dict) else getattr(pto, "kind", None)


Pto = Annotated[
    Annotated[LinearPto, Tag("linear")]
    | Annotated[LatchingPto, Tag("latching")]
    | Annotated[CoulombPto, Tag("coulomb")]
    | Annotated[TablePto, Tag("table")]
    | Annotated[PythonPto, Tag("python")],
    Discriminator(_pto_kind),
]


def _pto_count(pto) -> str:
    tables = isinstance(pto, dict) and all(isinstance(value, dict | Part) for value in pto.values())
    return "by joint" if tables else "one"


Ptos = Annotated[Annotated[Pto, Tag("one")] | Annotated[dict[str, Pto], Tag("by joint")], Discriminator(_pto_count)]


class Mooring(Part):
    """A mooring line from an anchor to a fairlead on a body, quasi-static by MoorPy (`bodies.moorings`)."""

    anchor: tuple[Number, Number, Number]  # in the tank [m]; at its floor the line rests on it
    fairlead: (
        str | tuple[Number, Number, Number]
    )  # site of the file, or a point of the tank, with the body as drawn [m]
    body: str | None = None  # that a point belongs to; None: the only one that moves
    length: Positive  # unstretched [m]
    mass: NonNegative  # per length, in air [kg/m]; 0 without a diameter: a straight spring that only pulls
    diameter: NonNegative = 0.0  # of a solid line of its volume, for its buoyancy [m]
    EA: Positive  # axial stiffness [N]


class BodyFile(Part):
    """Bodies of one MJCF file; MuJoCo gives mass, inertia, joints and contacts, the wet geoms meet the fluid."""

    mjcf: FilePath
    position: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)  # of the file's world origin in the tank [m]
    glued_layers: Annotated[int, Field(ge=0, le=3)] = (
        0  # of fluid, in the gap to fixed wet geoms, that move with the body
    )
    dry_inside: bool = False  # an open body starts without the water that it holds
    start: Literal["drawn", "equilibrium"] = "drawn"  # pose at t = 0; equilibrium: where the bodies float at rest
    moorings: dict[str, Mooring] = {}  # lines by name
    pto: Ptos = {}  # power take-off of the file's only joint, or joint name -> power take-off


class Control(Part):
    """A controller of the actuators: `FILE.py:NAME` is a function of the run as it stands, or a class whose objects are one;
    it sets `run.data.ctrl`."""

    function: FilePath
    interval: Positive | None = None  # from one call to the next [s]; None: before every step
    settings: dict[str, bool | Number | str] = {}  # for the class's __init__


def _known_field(name: str) -> str:
    if name not in FIELDS and name not in (known := known_fields()):
        raise PydanticKnownError("literal_error", {"expected": ", ".join(map(repr, known))})
    return name


FieldName = Annotated[str, AfterValidator(_known_field)]  # of the table in fsi.scene.fields


class Output(Part):
    """What is logged and how often."""

    series: NonNegative = 0.01  # time series: bodies, joints, gauges, probes, energies [s]; 0 is off
    particles: NonNegative = 0.1  # particle snapshots on the timeline [s]; 0 is off
    fields: tuple[FieldName, ...] = ("pressure",)  # that colour them, the first in view
    fraction: Annotated[float, Field(gt=0, le=1)] | None = None  # of the particles drawn; None: as the limit allows
    particles_limit: Positive = 100.0  # size of all snapshots of a run, for a fraction of None [MB]
    cloud: bool = False  # snapshots in run.mcap too, as foxglove.PointCloud
    values: bool = False  # positions, velocities, pressures and fields on the timeline as they are, in single precision
    mcap: bool = True  # write run.mcap
    timeline: bool = True  # write run.rrd
    checkpoint: NonNegative = 300.0  # wall time from one to the next, to resume from [s]; 0 is off
    on_failure: Literal["stop", "continue"] = (
        "stop"  # of a log that can no longer be written: the run fails, or does without
    )


class Alarms(Part):
    """Shares at which a run fails; it warns long before (`fsi.simulation.alarms`)."""

    lost_particles: Annotated[float, Field(gt=0, le=1)] = 0.01  # of the fluid's, that have left; a warning at a tenth
    energy: Positive = 1.0  # from nowhere, of what the fluid could fall by or was given; a warning at 0.02


class Scene(Part):
    """Everything that defines a run."""

    name: Annotated[str, Field(pattern=r"^[\w.-]*[\w-][\w.-]*$")] = "scene"  # also of the run folder
    description: str = ""  # one line, for `fsi cases`
    dimension: Literal[2, 3] = 2
    spacing: Positive  # particle spacing dr [m]
    duration: Positive  # simulated time [s]
    gravity: NonNegative = 9.81  # [m/s2]
    tank: Tank
    fluid: Fluid = Fluid()
    liquids: dict[str, Liquid] = {}  # others beside it, by name; their blocks take its place
    waves: Waves | None = None
    sea: Sea | None = None
    damping: tuple[DampingZone, ...] = ()
    gauges: dict[str, Gauge] = {}
    probes: dict[str, Probe] = {}
    velocimeters: dict[str, Velocimeter] = {}
    depths: dict[str, DepthGauge] = {}
    fluxes: dict[str, FluxPlane] = {}
    runups: dict[str, RunUp] = {}
    areas: dict[str, Area] = {}
    loads: dict[str, Load] = {}
    bodies: dict[str, BodyFile] = {}
    control: Control | None = None
    coupler: AnyCoupler = CouplerSettings()
    numerics: Numerics = Numerics()
    output: Output = Output()
    alarms: Alarms = Alarms()

    @model_validator(mode="before")
    @classmethod
    def _numerics_that_keep_waves(cls, values):
        return values | {"numerics": found} if (found := wave_numerics(values)) else values

    @property
    def smoothing_length(self) -> float:
        """h [m]; the kernel's support is 2 h."""
        return self.numerics.smoothing_ratio * self.spacing

    @property
    def all_liquids(self) -> tuple[Liquid, ...]:
        """The fluid, then the others in their order."""
        return (self.fluid, *self.liquids.values())

    @property
    def closed(self) -> bool:
        """True where the fluid fills the tank and has no free surface."""
        return not self.fluid.blocks and self.fluid.still_water_level == self.tank.max[-1]

    @property
    def shifting(self) -> float:
        """Coefficient of the particle shift; 0 is off."""
        return (0.5 if self.closed else 0.0) if self.numerics.shifting is None else self.numerics.shifting

    @property
    def single_layer(self) -> bool:
        """True where boundary particles stand in one layer and count by weights (`tank.boundary`)."""
        return self.tank.boundary == "single_layer" or (
            self.tank.boundary == "auto" and self.numerics.solver == "iisph"
        )

    @property
    def reading_length(self) -> float:
        """Smoothing length that gauges and probes read the fluid with [m]."""
        return max(self.numerics.smoothing_ratio, 1.2) * self.spacing

    @property
    def layers(self) -> int:
        """Boundary particle layers that fill the kernel's support; one where they count by weights."""
        return 1 if self.single_layer else math.ceil(2 * self.numerics.smoothing_ratio - 1e-9)
