"""Parts of a scene whose model is chosen by a key, such as `waves.kind`, and found when a scene asks for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationInfo
from pydantic_core import PydanticKnownError, core_schema


@dataclass(frozen=True)
class ChosenBy:
    """Pydantic annotation of a part: the value of `key`, `default` if not given, names its model.

    `names()` are the known values, `load(name)` imports the model of one. Only the chosen one is imported; the JSON schema
    and the list of known keys in an error import all."""

    key: str
    default: str
    names: Callable[[], Iterable[str]]
    load: Callable[[str], type[BaseModel]]

    def models(self) -> list[type[BaseModel]]:
        """All models."""
        return [self.load(name) for name in self.names()]

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
            return self.load(chosen).model_validate({self.key: chosen} | value, context=info.context)

        def dump(value: BaseModel, info):
            return value.model_dump(mode=info.mode, exclude_none=info.exclude_none)

        return core_schema.with_info_plain_validator_function(
            validate, serialization=core_schema.plain_serializer_function_ser_schema(dump, info_arg=True)
        )

    def __get_pydantic_json_schema__(self, schema, handler):
        return {"oneOf": [handler(model.__pydantic_core_schema__) for model in self.models()]}
