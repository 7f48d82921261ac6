"""What a study is: a base scene, named parameters, how their values are chosen and what makes a design good.

The values are checked here one by one; `cases.study.study_file` reads them from TOML.
"""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, SerializeAsAny, model_validator

from fsi.scene.file import key_steps
from fsi.scene.model import FilePath, NonNegative, Number, Part, Positive, Scene

Count = Annotated[int, Field(ge=1, le=1_000_000)]
Value = bool | int | float | str
SAME = {"waves.Te": "waves.peak_period"}  # energy period, and what becomes of it
RESERVED = {"run", "joint", "body", "gauge", "probe", "status", "reason", "run_hash"}


class Parameter(Part):
    """One parameter of a study: a key of the scene, an attribute of an MJCF element, or an argument of the script.

    Give `values`, or `min` and `max` with a `count` for a grid; `scale` says how they are spread between.
    """

    key: Annotated[str, Field(min_length=1)]
    units: str = ""
    description: str = ""
    values: tuple[Value, ...] = ()
    min: Number | None = None
    max: Number | None = None
    count: Annotated[int, Field(ge=2)] | None = None
    scale: Literal["linear", "log"] = "linear"
    whole: bool = False  # whole numbers only, between min and max

    @model_validator(mode="after")
    def _one_way(self):
        if bool(self.values) == (self.min is not None or self.max is not None):
            raise ValueError("give either values or min and max; with min and max a grid also needs count")
        if self.values:
            if len(set(self.values)) < len(self.values):
                raise ValueError("a value stands twice in values; remove one")
            if odd := [v for v in self.values if isinstance(v, float) and not math.isfinite(v)]:
                raise ValueError(f"values hold {odd[0]}, which is no number; remove it")
            return self
        if self.min is None or self.max is None or self.min >= self.max:
            raise ValueError("min must lie below max; give both")
        if self.scale == "log" and self.min <= 0:
            raise ValueError(f"min = {self.min:g} has no logarithm; use a positive min or scale = 'linear'")
        return self

    def at(self, fraction: float) -> Value:
        """The value at a fraction 0 to 1 of the way from min to max, or along the list of values."""
        if self.values:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        if self.scale == "log":
            value = math.exp(math.log(self.min) + fraction * (math.log(self.max) - math.log(self.min)))
        else:
            value = self.min + fraction * (self.max - self.min)
        return round(value) if self.whole else float(f"{value:.12g}")

    def grid(self) -> tuple[Value, ...]:
        """The values of a grid along this parameter."""
        if self.values:
            return self.values
        return tuple(dict.fromkeys(self.at(n / (self.count - 1)) for n in range(self.count)))


class Sampling(Part):
    """How the points of the study are chosen."""

    method: Literal["grid", "list", "latin_hypercube", "optimise"] = "grid"
    samples: Count | None = None  # of a Latin hypercube; runs of an optimisation
    seed: int = 0
    points: tuple[dict[str, Value], ...] = ()  # `list`: the points themselves; `optimise`: those to try first


class Objective(Part):
    """The figure that an optimisation makes as large or as small as it can."""

    maximise: str = ""
    minimise: str = ""

    @model_validator(mode="after")
    def _one(self):
        if bool(self.maximise) == bool(self.minimise):
            raise ValueError("give one of maximise and minimise")
        return self

    @property
    def figure(self) -> str:
        return self.maximise or self.minimise

    @property
    def sign(self) -> int:
        """+1 where more is better, -1 where less is."""
        return 1 if self.maximise else -1


class Bounds(Part):
    """Limits of a figure that a design must keep."""

    min: Number | None = None
    max: Number | None = None

    @model_validator(mode="after")
    def _some(self):
        if self.min is None and self.max is None:
            raise ValueError("give min, max or both")
        return self

    def excess(self, value: float) -> float:
        """By how much a value breaks the limits; 0 or less keeps them, nan breaks them."""
        over = [value - self.max] if self.max is not None else []
        under = [self.min - value] if self.min is not None else []
        return math.inf if math.isnan(value) else max(over + under)


class Measure(Part):
    """How figures are taken from a run."""

    start: NonNegative | None = (
        None  # [s] where means begin; None: after the ramp and the way of the waves to the bodies
    )
    device_width: Positive | None = None  # [m] for the capture width ratio; None: tank.width in 2D
    decay_joint: str = ""  # joint of a free decay; empty: the first one
    storm_duration: Positive = 10800.0  # [s] that an extreme response is the largest of


class Bem(Part):
    """Linear potential theory to compare a RAO, a power matrix, added mass and damping with."""

    file: FilePath  # netCDF of Capytaine
    dof: str = ""  # its degree of freedom that is the joint
    dofs: dict[str, str | dict[str, Number]] = Field(
        default_factory=dict
    )  # of several joints: how each moves those of the file
    joint: str = ""  # that `dof` is of, and that the power take-off is on; empty: the first one
    damping: NonNegative | str = 0.0  # of the power take-off, or the parameter that holds it [N s/m or N m s/rad]
    stiffness: NonNegative = 0.0  # of the power take-off [N/m or N m/rad]

    @model_validator(mode="after")
    def _joints(self):
        if bool(self.dof) == bool(self.dofs):
            raise ValueError("give one of dof, for a single joint, and dofs, a table from joints to degrees of freedom")
        if self.joint and self.dofs and self.joint not in self.dofs:
            raise ValueError(f"joint {self.joint!r} is not in dofs; add it there")
        return self


class Study(Part):
    """A study; as a file see `docs/guide/studies.md`."""

    name: Annotated[str, Field(pattern=r"^[\w.-]*[\w-][\w.-]*$")] = "study"
    description: str = ""
    scene: SerializeAsAny[Scene] | str  # a scene, the path of a scene file, or a built-in name
    script: FilePath | None = None  # Python file whose `build(folder, **arguments)` makes the geometry
    routine: Literal["damping_sweep", "power_matrix", "rao", "radiation", "free_decay", "extreme"] | None = None
    settings: Annotated[
        dict[str, Any], Field(alias="set", default_factory=dict)
    ]  # values of the scene, the same in every run
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    sampling: Sampling = Sampling()
    objective: Objective | None = None
    constraints: dict[str, Bounds] = Field(default_factory=dict)
    measure: Measure = Measure()
    bem: Bem | None = None

    model_config = Part.model_config | {"populate_by_name": True}

    @model_validator(mode="after")
    def _consistent(self):
        for fault in _faults(self):
            raise ValueError(fault)
        return self


def _faults(study: Study):
    """What contradicts itself, as `key: fault; fix`."""
    method, sampling = study.sampling.method, study.sampling
    for name, parameter in study.parameters.items():
        if not name.isidentifier() or name in RESERVED:
            fix = f"use letters, digits and _, and none of {', '.join(sorted(RESERVED))}"
            yield f"parameters.{name}: cannot be the name of a parameter; {fix}"
        if parameter.key.startswith("script.") and study.script is None:
            yield f"parameters.{name}.key: {parameter.key!r} needs a script; add script = 'FILE.py'"
        if method == "grid" and not parameter.values and parameter.count is None:
            yield f"parameters.{name}: a grid needs values, or a count between min and max; add count"
    for (one, a), (two, b) in combinations(study.parameters.items(), 2):
        if _overlap(a.key, b.key):
            yield f"parameters.{two}.key: {b.key!r} sets what parameters.{one} sets, {a.key!r}; remove one of them"
    if method == "list" and not sampling.points:
        yield "sampling.points: a list needs its points; add e.g. points = [{period = 1.5}, {period = 2.0}]"
    if method in ("grid", "latin_hypercube") and sampling.points:
        yield f"sampling.points: of no use to a {method}; use method = 'list'"
    if method in ("latin_hypercube", "optimise"):
        if sampling.samples is None:
            yield f"sampling.samples: {method} needs to know how many runs; add e.g. samples = 20"
        if not study.parameters:
            yield f"parameters: {method} needs at least one; add [parameters.NAME]"
    if method == "optimise" and study.objective is None:
        yield "objective: an optimisation needs one; add [objective] with maximise = 'FIGURE'"
    for n, point in enumerate(sampling.points):
        odd = set(point) - set(study.parameters)
        short = set(study.parameters) - set(point)
        if odd or short:
            what = f"has no parameter {min(odd)!r}" if odd else f"lacks {min(short)!r}"
            yield f"sampling.points[{n}]: {what}; name every parameter of the study: {', '.join(study.parameters)}"
    if study.bem and study.routine not in ("rao", "radiation", "power_matrix"):
        yield (
            "bem: only a RAO, a power matrix, added mass and damping are compared with linear theory; "
            "set routine = 'rao', 'power_matrix' or 'radiation'"
        )
    given = (*study.settings, *(parameter.key for parameter in study.parameters.values()))
    if study.routine != "radiation" and any(key.split(".")[0] == "radiation" for key in given):
        yield "routine: keys of radiation need it; set routine = 'radiation'"


def _overlap(one: str, two: str) -> bool:
    """Whether of two keys one holds the other, so that only the later would count. An attribute of an MJCF file and the
    file itself go together."""
    short, long = sorted((key_steps(SAME.get(one, one)), key_steps(SAME.get(two, two))), key=len)
    return long[: len(short)] == short and (short == long or short[-1] != "mjcf")


def resolve_path(study: Study, folder: Path) -> str | Scene:
    """The scene as `fsi.load_scene` takes it: a path relative to the study's folder counts from there."""
    if isinstance(study.scene, Scene):
        return study.scene
    path = folder / Path(study.scene).expanduser()
    return str(path) if path.is_file() else study.scene
