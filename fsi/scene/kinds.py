"""Parts of a scene whose model is chosen by a key, such as `waves.kind`, and found when a scene asks for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationInfo
from pydantic_core import PydanticKnownError, core_schema

from fsi.errors import SceneError


@dataclass(frozen=True)
class ChosenBy:
    """Pydantic annotation of a part: the value of `key`, `default` if not given, names its model.

    `names()` are the known values, `load(name)` imports the model of one. Only the chosen one is imported; the JSON schema
    and the list of known keys in an error import all."""

    key: str
    default: str
    names: Callable[[], Iterable[str]]
    load: Callable[[str], type[BaseModel]]

    def models(self) -> dict[str, type[BaseModel]]:
        """All models by name, but for those of packages that cannot be imported."""
        found = {}
        for name in self.names():
            with suppress(SceneError):
                found[name] = self.load(name)
        return found

    def __get_pydantic_core_schema__(self, source, handler):
        def validate(value: Any, info: ValidationInfo):
            if type(value) is source and getattr(value, self.key, self.default) != self.default:
                value = value.model_dump(exclude_unset=True)  # the base, made in Python: of another model
            if isinstance(value, source):
                return value
            if not isinstance(value, dict):
                raise PydanticKnownError("union_tag_not_found", {"discriminator": self.key})
            chosen = value.get(self.key, self.default)
            if chosen not in (known := list(self.names())):
                tags = ", ".join(map(repr, known))
                context = {"discriminator": self.key, "tag": str(chosen), "expected_tags": tags}
                raise PydanticKnownError("union_tag_invalid", context)
            shared = source.model_fields
            own = self.key not in shared or chosen != self.default or not value.keys() <= shared.keys()
            model = self.load(chosen) if own else source  # the base stands for the default, as long as it has no keys
            return model.model_validate({self.key: chosen} | value, context=info.context)

        return core_schema.with_info_plain_validator_function(
            validate, serialization=core_schema.simple_ser_schema("any")
        )  # written as what it is

    def __get_pydantic_json_schema__(self, schema, handler):
        return {"oneOf": [handler(model.__pydantic_core_schema__) for model in self.models().values()]}
