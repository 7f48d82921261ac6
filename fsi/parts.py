"""What every part of a scene is built from: the base class and the types of its values.

SI units; in two dimensions points are (x, z), in three (x, y, z).
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo

from fsi.plugins import hidden


def _locate(path: str | Path, info: ValidationInfo) -> Path:
    """The absolute path: `package://NAME/...` lies in that installed package, a relative path in the folder of the
    scene file, or in the working directory for a scene that was made in Python."""
    if not isinstance(path, str | Path):
        raise ValueError(f"{path!r} should be a path")
    if str(path).startswith("package://"):
        package, _, rest = str(path).removeprefix("package://").partition("/")
        spec = find_spec(package) if package.isidentifier() else None
        if spec is None or not spec.submodule_search_locations:
            raise ValueError(f"no installed package {package!r}; write package://bodies/models/FILE or a plain path")
        if fix := hidden(package):
            raise ValueError(f"lies in another package {package!r} than Spindrift's; {fix}")
        return Path(spec.submodule_search_locations[0], rest).absolute()
    return Path((info.context or {}).get("folder", "."), Path(path).expanduser()).resolve()


FilePath = Annotated[Path, BeforeValidator(_locate)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Point = Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)]
Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]


class Part(BaseModel):
    """Base of every part of a scene: immutable, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, strict=False)
