"""Validation errors in the words of the scene: `file: key: fault; fix`."""

from __future__ import annotations

import re
import reprlib
from difflib import get_close_matches
from typing import get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from fsi.errors import SceneError
from fsi.scene.kinds import ChosenBy
from fsi.scene.model import Scene

SHORT = reprlib.Repr()
SHORT.maxlevel, SHORT.maxstring, SHORT.maxother, SHORT.maxlong = 3, 80, 80, 40
SHAPES = {  # pydantic's type of error -> what should be there
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "union_tag_not_found": "a table",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a string",
    "finite_number": "a finite number",
}


def fault_lines(errors: ValidationError, data: dict, file: object, root: type[BaseModel] = Scene) -> list[str]:
    """One line for each error; `data` is what was validated as a `root`."""
    lines, found = [], errors.errors(include_url=False)
    for error in found:
        if error["type"] == "too_short" and any(_inside(other["loc"], error["loc"]) for other in found):
            continue  # it does not count the items that are wrong themselves
        place = _place(error, data)
        fault, fix = _explain(error, place, root)
        lines.append(str(SceneError(fault, key=_key(place), file=file, fix=fix)))
    return lines


def _inside(place: tuple, part: tuple) -> bool:
    return len(place) > len(part) and place[: len(part)] == part


def _place(error: dict, data) -> list:
    """The steps to the error that are in the file: pydantic also lists the branch that it took in a union."""
    place = []
    for step in error["loc"]:
        if step in data if isinstance(data, dict) else isinstance(data, list) and step in range(len(data)):
            data = data[step]
            place.append(step)
    return [*place, error["loc"][-1]] if error["type"] == "missing" else place


def _key(place: list) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).lstrip(".")


def _explain(error: dict, place: list, root: type[BaseModel]) -> tuple[str, str]:
    """Fault and fix of one error."""
    kind, given, context = error["type"], error["input"], error.get("ctx", {})
    if kind == "extra_forbidden":
        key, known = (
            str(place[-1]),
            _known_keys(place[:-1], root),
        )  # of all kinds of the part: the key may belong to another
        if owners := _owners(place, root):
            return "unknown key", f"it belongs to {owners}"
        return "unknown key", _choice(key, [k for k in known if k != key], "known are {}")
    if kind == "missing":
        return "missing", "add it"
    if kind == "literal_error":
        allowed = [text or number for text, number in re.findall(r"'([^']*)'|(\d+)", context["expected"])]
        return f"{_shown(given)} is not one of {', '.join(allowed)}", _choice(str(given), allowed, "use one of them")
    if kind == "union_tag_invalid":
        allowed = re.findall(r"'([^']*)'", context["expected_tags"])
        key = context["discriminator"] if context["discriminator"].isidentifier() else "kind"
        fault = f"the {key} {_shown(context['tag'])} is not one of {', '.join(allowed)}"
        return fault, _choice(str(context["tag"]), allowed, "use one of them")
    if kind == "value_error":
        fault, _, fix = str(context["error"]).partition("; ")
        return fault, fix
    if kind in SHAPES:
        return f"{_shown(given)} should be {SHAPES[kind]}", ""
    if kind == "string_pattern_mismatch":  # of the names that are those of folders, too
        return f"{_shown(given)} is no name of a folder", "use letters, digits, _, - and dots, and not dots alone"
    demand = error["msg"].partition("should ")[2].partition(" after validation")[0]
    return f"{_shown(given)} should {demand}" if demand else f"{_shown(given)}: {error['msg']}", ""


def _shown(given: object) -> str:
    """A value as Python writes it, cut where it is long or deep."""
    return SHORT.repr(given)


def _choice(given: str, known: list[str], otherwise: str) -> str:
    """The fix for a word that is not known."""
    close = [word for word in known if given in word] if len(given) > 3 else []
    close = close or get_close_matches(given, known, n=1)
    return f"did you mean {close[0]}?" if close else otherwise.format(", ".join(known))


def _known_keys(place: list, root: type[BaseModel]) -> list[str]:
    """The keys of the part of `root` at `place`."""
    parts = [root]
    for step in place:
        inner = [p for part in parts if step in part.model_fields for p in _models(part.model_fields[step])]
        parts = inner or parts
    return sorted({key for part in parts for key in part.model_fields})


def _owners(place: list, root: type[BaseModel]) -> str:
    """The choices, such as `kind = 'packet'`, that a key of the part of `root` has a use with; "" where there are none."""
    *parts, key = place
    if len(parts) != 1 or parts[0] not in root.model_fields:
        return ""
    field = root.model_fields[parts[0]]
    chosen = [choice for choice in field.metadata if isinstance(choice, ChosenBy)] + _choices(field.annotation)
    found = [f"{c.key} = {name!r}" for c in chosen for name, model in c.models().items() if key in model.model_fields]
    return " or ".join(found)


def _models(field: FieldInfo) -> list[type[BaseModel]]:
    """Every part of a scene that a field of a part may hold."""
    chosen = [choice for choice in field.metadata if isinstance(choice, ChosenBy)] + _choices(field.annotation)
    return [model for choice in chosen for model in choice.models().values()] or _parts(field.annotation)


def _choices(annotation) -> list[ChosenBy]:
    found = [extra for extra in getattr(annotation, "__metadata__", ()) if isinstance(extra, ChosenBy)]
    return found + [choice for inner in get_args(annotation) for choice in _choices(inner)]


def _parts(annotation) -> list[type[BaseModel]]:
    """Every part of a scene that a type annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [part for inner in get_args(annotation) for part in _parts(inner)]
