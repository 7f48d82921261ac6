"""What a scene measures: gauges, probes, velocimeters, flux planes, run-up lines, areas that are flooded, and loads on fixed
structures. In two dimensions points are (x, z) and places on the ground are (x); in three (x, y, z) and (x, y)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fsi.parts import Number, Part, Point, Positive

Foot = Annotated[tuple[Number, ...], Field(min_length=1, max_length=2)]  # a place on the ground [m]


class Gauge(Part):
    """Wave gauge: free-surface elevation above still water on the vertical through `x` (and `y`), by one of three readings
    (`fsi.fluid.gauges`)."""

    x: Number
    y: Number = 0.0
    reading: Literal["surface", "particles", "points"] = "surface"


class Probe(Part):
    """Pressure probe at a point [m], or at a site of a body file. With `body` it rides on that body; the point is then where
    it is at the start."""

    position: Point | None = None
    body: str | None = None  # name of a moving wet body
    site: str | None = None  # of a body file, in place of position and body

    @model_validator(mode="after")
    def _placed(self):
        if (self.position is None) == (self.site is None):
            raise ValueError("needs either a position or a site; give one of the two")
        if self.site is not None and self.body is not None:
            raise ValueError("has a site and a body; leave the body out: the site belongs to one")
        return self


class Velocimeter(Part):
    """Velocity of the fluid at a point [m], or a profile of it at so many `points` on the line from there to `end`."""

    position: Point
    end: Point | None = None
    points: Annotated[int, Field(ge=2, le=1000)] = 10

    @property
    def places(self) -> list[tuple[float, ...]]:
        """All points of it, in their order."""
        if self.end is None:
            return [self.position]
        shares = [n / (self.points - 1) for n in range(self.points)]
        return [tuple(a + s * (b - a) for a, b in zip(self.position, self.end, strict=True)) for s in shares]


class FluxPlane(Part):
    """A plane piece across one axis, on which `min` and `max` [m] are the same; the discharge through it counts along the
    axis."""

    min: Point
    max: Point

    @model_validator(mode="after")
    def _flat(self):
        if len(self.min) != len(self.max):
            raise ValueError(f"min has {len(self.min)} and max {len(self.max)} components; give both the same number")
        flat = [a == b for a, b in zip(self.min, self.max, strict=True)]
        if sum(flat) != 1:
            raise ValueError("min and max must be the same on exactly one axis, the one that the plane stands across")
        if any(a > b for a, b in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on the other axes; swap them")
        return self

    @property
    def axis(self) -> int:
        """Number of the axis that it stands across."""
        return [a == b for a, b in zip(self.min, self.max, strict=True)].index(True)


class RunUp(Part):
    """Run-up along a line on the ground from `start`, which is wet, to `end`: the water line is where the fluid gets thinner
    than `depth` [m], a spacing if not given."""

    start: Foot
    end: Foot
    depth: Positive | None = None


class Area(Part):
    """A rectangle of ground: how much of it is under at least `depth` [m] of fluid, a spacing if not given."""

    min: Foot
    max: Foot
    depth: Positive | None = None

    @model_validator(mode="after")
    def _ordered(self):
        if len(self.min) != len(self.max) or any(a >= b for a, b in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on every axis")
        return self


class DepthGauge(Part):
    """Thickness of the layer of fluid over the place `x` (and `y`)."""

    x: Number
    y: Number = 0.0


class Load(Part):
    """Force of the fluid on a part of what does not move: on a side of the tank such as "x+", on the "bathymetry", or on a
    static wet geom by its name; with `min` and `max` on the part of it whose face lies in that box. Without `on`, on all
    that is in the box."""

    on: str | None = None
    min: Point | None = None
    max: Point | None = None
    about: Point | None = None  # point of the torque [m]; the origin if not given

    @model_validator(mode="after")
    def _chosen(self):
        if (self.min is None) != (self.max is None):
            raise ValueError("has only one of min and max; give both or none")
        if self.on is None and self.min is None:
            raise ValueError("needs `on`, or a box with min and max, or both")
        if self.min is not None and (
            len(self.min) != len(self.max) or any(a >= b for a, b in zip(self.min, self.max, strict=True))
        ):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on every axis")
        return self
