"""Explanations: pydantic's errors in the words of a scene file, each with what would be right."""

import difflib
import json
import math
import re
from typing import Any, get_args

from pydantic import BaseModel

from sandbox.scene.drives import Driven, PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.faults import Location
from sandbox.scene.joints import (
    Gear,
    Groove,
    Joined,
    Motor,
    Pivot,
    Rod,
    RotaryLimit,
    RotarySpring,
    Slide,
    Spring,
)
from sandbox.scene.model import Scene

_EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "tuple_type": "an array, such as [0.0, 1.0]",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "greater_than": "greater than {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "less than {lt:g}",
    "less_than_equal": "{le:g} or less",
    "too_short": "an array of {min_length} or more",
    "too_long": "an array of {max_length} at most",
    "string_too_short": "text of {min_length} or more characters",
    "string_too_long": "text of {max_length} characters at most",
    "literal_error": "one of {expected}",
}

_RANGES = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}

_DEGREES = 720
"""What is more than two turns in degrees is not taken for such."""

_RAD = re.compile(r"\brad\b(?!/)")
"""rad, and not rad/s"""


def explain(details: Any) -> tuple[Location, str]:
    """Return the location of one of pydantic's errors, and what is wrong there and would be right."""
    location = place_of(details)
    if location[:1] == ("cloth",) and location[2:3] == ("pins",):
        expected = "'top', 'corners', 'left', or the column and row of nodes, such as [[0, 0], [9, 0]]"
        return location[:3], f"is not right here; it should be {expected}"
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if location[:1] == ("attraction",) and location[2:3] == ("toward",) and (kind != "missing" or len(location) > 3):
        return location[:3], "is not right here; it should be a place, such as [0.0, 0.0], or the name of a body"
    if kind == "missing":
        return location, "is missing; it must be given"
    if kind == "extra_forbidden":
        return location, f"unknown key; {_known_keys(tuple(details['loc']))}"
    if kind == "json_invalid":
        return location, f"the scene cannot be read: {context['error']}"
    if kind == "union_tag_not_found":
        return location, f"is missing; {_one_of(location)}"
    if kind == "union_tag_invalid":
        tag = context["tag"]
        return location, f"{_shown(tag)} is not right here; {_one_of(location)}"
    if kind == "value_error":
        return location, str(context["error"])
    if kind == "string_pattern_mismatch":
        expected = "text '#rrggbb'" if location[-1] == "colour" else "text without control characters"
    elif kind == "tuple_type" and len(location) == 1:
        expected = f"tables, each headed [[{location[0]}]]"
    elif location[:1] == ("joint",) and location[-1] == "between":
        expected = 'the name of one body or of two, such as ["a", "b"]'
    elif kind in ("too_short", "too_long") and location[-1] != "points":
        expected = f"an array of {context.get('max_length', context.get('min_length'))}"
    elif kind in _EXPECTED:
        expected = _EXPECTED[kind].format(**context)
        if kind in _RANGES and abs(value) <= _DEGREES and _is_angle(tuple(details["loc"])):
            expected += f", in rad; {value:g}° is {math.radians(value):.4g}"
    else:
        expected = details["msg"].removeprefix("Input should be ")
    return location, f"{_shown(value)} is not right here; it should be {expected}"


def _is_angle(location: Location) -> bool:
    """Tell whether what stands at a location is in rad, as the docstring of its field says."""
    from sandbox.scene.docstrings import docstrings  # reads sources, which only this wants

    last = max(k for k, key in enumerate(location) if isinstance(key, str))
    try:
        model = model_at(location[:last])
    except (KeyError, StopIteration):  # it lies in one of several forms that a value may have
        return False
    told = docstrings(model)
    name = next((name for name, field in model.model_fields.items() if (field.alias or name) == location[last]), "")
    return _RAD.search(told.get(name, "")) is not None


def place_of(details: Any) -> Location:
    """Return where in a document one of pydantic's errors is: of joints and drives one key is a tag."""
    location: Location = tuple(details["loc"])
    if len(location) > 2 and location[0] in TAGGED:
        return location[:2] + location[3:]
    if details["type"] in ("union_tag_invalid", "union_tag_not_found"):
        return (*location, "kind")
    return location


def _shown(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _known_keys(location: Location) -> str:
    """Say which keys there are at a location, or the one that was likely meant."""
    known = [field.alias or name for name, field in model_at(location[:-1]).model_fields.items()]
    close = difflib.get_close_matches(str(location[-1]), known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known here: {', '.join(known)}"


def model_at(location: Location) -> type[BaseModel]:
    """Return the model of a table by its location in a document; of joints and drives, the kind follows the number."""
    model: type[BaseModel] = Scene
    for key in location:
        if model is Scene and key in TAGGED:
            kinds, common = TAGGED[str(key)]
            return kinds.get(str(location[2]), common) if len(location) > 2 else common
        if isinstance(key, str):
            fields = {field.alias or name: field.annotation for name, field in model.model_fields.items()}
            model = next(m for m in (fields[key], *get_args(fields[key])) if _is_model(m))
    return model


JOINTS: dict[str, type[BaseModel]] = {
    tag: model
    for model in (Rod, Pivot, Slide, Groove, RotaryLimit, Motor, Gear, Spring, RotarySpring)
    for tag in get_args(model.model_fields["kind"].annotation)
}
"""The kinds of joints by their words."""

DRIVES: dict[str, type[BaseModel]] = {"torque": TorqueDrive, "stroke": StrokeDrive, "plunger": PlungerDrive}
"""The kinds of drives by theirs."""

TAGGED: dict[str, tuple[dict[str, type[BaseModel]], type[BaseModel]]] = {
    "joint": (JOINTS, Joined),
    "drive": (DRIVES, Driven),
}
"""Tables of several kinds: these by their words, and what all of them have."""


def _one_of(location: Location) -> str:
    return f"a {location[0]} is one of {', '.join(TAGGED[str(location[0])][0])}"


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
