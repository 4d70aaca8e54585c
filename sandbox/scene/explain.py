"""Explanations: pydantic's errors in the words of a scene file, each with what would be right."""

import difflib
import json
import math
import re
from collections.abc import Iterator
from typing import Annotated, Any, get_args, get_origin

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
    "too_short": "an array of {min_length} or more",
    "too_long": "an array of {max_length} at most",
    "string_too_short": "text of {min_length} or more characters",
    "string_too_long": "text of {max_length} characters at most",
    "literal_error": "one of {expected}",
}

_RANGES = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
"""The bound that each of pydantic's errors speaks of."""

_LARGE = 1e5
"""A bound beyond this only keeps nonsense away from the engines: a message names it where it is exceeded, not where the
other bound is. The same holds for a smallest positive value below its reciprocal."""

_DEGREES = 720
"""What is more than two turns in degrees is not taken for such."""

_RAD = re.compile(r"\brad\b(?!/)")
"""rad, and not rad/s"""


def explain(details: Any) -> tuple[Location, str]:
    """Return the location of one of pydantic's errors, and a message: what is wrong there, and what would be right."""
    location = place_of(details)
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if location[:1] == ("cloth",) and location[2:3] == ("pins",):
        return location[:3], "must be 'top', 'corners', 'left', or columns and rows of nodes, such as [[0, 0], [9, 0]]"
    if location[:1] == ("attraction",) and location[2:3] == ("toward",) and (kind != "missing" or len(location) > 3):
        return location[:3], "must be a position, such as [0.0, 0.0], or the name of a body"
    if kind == "missing":
        if isinstance(location[-1], int):
            return location[:-1], _too_few(details)
        return location, "is missing; it must be given"
    if kind == "extra_forbidden":
        return location, f"unknown key; {_known_keys(tuple(details['loc']))}"
    if kind == "json_invalid":
        return location, f"the scene cannot be read: {context['error']}"
    if kind == "union_tag_not_found":
        return location, f"is missing; {_one_of(location)}"
    if kind == "union_tag_invalid":
        return location, f"is {_shown(context['tag'])}; {_one_of(location)}"
    if kind == "value_error":
        return location, str(context["error"])
    if kind == "string_pattern_mismatch":
        expected = "text '#rrggbb'" if location[-1] == "colour" else "text without control characters"
    elif kind == "tuple_type" and len(location) == 1:
        expected = f"tables, each headed [[{location[0]}]]"
    elif location[:1] == ("joint",) and location[-1] == "between":
        expected = 'the name of one body or of two, such as ["a", "b"]'
    elif kind in ("too_short", "too_long") and location[-1] != "points":
        expected = f"an array of {_length(tuple(details['loc']), context)}"
    elif kind in _RANGES:
        expected = _range(tuple(details["loc"]), _RANGES[kind], context, value)
    elif kind in _EXPECTED:
        expected = _EXPECTED[kind].format(**context)
    else:
        expected = details["msg"].removeprefix("Input should be ")
    message = f"must be {expected}, is {_shown(value)}"
    if kind in _RANGES and abs(value) <= _DEGREES and _is_angle(tuple(details["loc"])):
        message += f"; angles are in rad, and {value:g}° is {math.radians(value):.4g}"
    return location, message


def _too_few(details: Any) -> str:
    """Return the message for an array that lacks values: how many it must have, and how many it has."""
    location = tuple(details["loc"])
    wanted = len(get_args(_annotation_at(location[:-1]))) or location[-1] + 1
    has = len(details["input"])
    if place_of(details)[:2] == ("pinball", "slingshot"):
        return f"a slingshot has {wanted} corners: the ends of the side that kicks, and one behind; here are {has}"
    return f"must be an array of {wanted}, has {has}"


def _length(location: Location, context: Any) -> str:
    """Return how many values an array must have, of which pydantic names one bound."""
    for each in _bounds(location):
        low, high = each.get("min_length"), each.get("max_length")
        if low != high and context.get("min_length", low) == low and context.get("max_length", high) == high:
            return f"{low} or {high}" if low is not None and high == low + 1 else f"{low or 0} to {high}"
    return str(context.get("max_length", context.get("min_length")))


def _range(location: Location, violated: str, context: Any, value: float) -> str:
    """Return in words which numbers are allowed at a location, of which one bound was `violated`.

    Both bounds are named where both are of a size that people use, else the one that was violated.
    """
    bound = context[violated]
    bounds = next((each for each in _bounds(location) if each.get(violated) == bound), {violated: bound})
    low, high = bounds.get("ge", bounds.get("gt")), bounds.get("le", bounds.get("lt"))
    if low is not None and high is not None and (low == -high or (low >= 0 and high <= _LARGE)):
        positive = "gt" in bounds or 0 < low < 1 / _LARGE
        if not positive:
            return f"between {low:g} and {high:g}" + (" exclusive" if "lt" in bounds else "")
        if value <= 0 or violated in ("le", "lt"):
            return f"greater than 0 and at most {high:g}"
    if violated == "ge" and 0 < bound < 1 / _LARGE and value <= 0:
        return "greater than 0"
    words = {"gt": "greater than {:g}", "ge": "at least {:g}", "lt": "less than {:g}", "le": "at most {:g}"}
    return words[violated].format(bound)


_KEYS = ("ge", "gt", "le", "lt", "min_length", "max_length")
"""The bounds of a value, as pydantic calls them."""


def _bounds(location: Location) -> Iterator[dict[str, float]]:
    """Yield the bounds that a field states, of itself and of what its values are made of, by their `_KEYS`."""
    field = _field_at(location)
    if field is not None:
        yield from _bounds_in(field.annotation, field.metadata)


def _bounds_in(annotation: Any, metadata: Any = ()) -> Iterator[dict[str, float]]:
    if get_origin(annotation) is Annotated:
        annotation, *more = get_args(annotation)
        metadata = [each for one in more for each in getattr(one, "metadata", [one])]
    found = {key: getattr(each, key) for each in metadata for key in _KEYS if hasattr(each, key)}
    if found:
        yield found
    for inner in get_args(annotation):
        yield from _bounds_in(inner)


def _field_at(location: Location) -> Any:
    """Return the field that a location is in; None where its value may have one of several forms."""
    last = max((k for k, key in enumerate(location) if isinstance(key, str)), default=None)
    if last is None:
        return None
    try:
        model = model_at(location[:last])
    except (KeyError, StopIteration):
        return None
    fields = ((field.alias or name, field) for name, field in model.model_fields.items())
    return next((field for name, field in fields if name == location[last]), None)


def _annotation_at(location: Location) -> Any:
    """Return the type of the value at a location within arrays of fixed length; None where it is none of these."""
    field = _field_at(location)
    annotation = None if field is None else field.annotation
    last = max(k for k, key in enumerate(location) if isinstance(key, str))
    for key in (None, *location[last + 1 :]):  # None: of the field itself
        if key is not None:
            inner = get_args(annotation)
            if not inner:
                return None
            annotation = inner[0] if inner[-1] is Ellipsis else inner[int(key)] if int(key) < len(inner) else None
        while get_origin(annotation) is not tuple and get_args(annotation):  # Annotated, or one that may be left out
            annotation = get_args(annotation)[0]
    return annotation if Ellipsis not in get_args(annotation) else None


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
    if isinstance(value, float) and value.is_integer():
        return f"{value:.15g}"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _known_keys(location: Location) -> str:
    """Say which keys there are at a location, or the one that was likely meant, here or in another table."""
    key, known = str(location[-1]), keys_of(model_at(location[:-1]))
    if key in ("engine", "engines"):
        return "a scene does not choose its engine; the command line does, by --engine NAME"
    for table in _COMMON_TABLES:
        if key in keys_of(model_at((table,))):
            return f"did you mean {table}.{key}?"
    if len(location) == 1:
        homes = [table for table in list_tables() if key in keys_of(model_at((table, 0)))]
        if homes:
            some = ", ".join(f"[[{table}]]" for table in homes[:3])
            return f"it is a key of {some}{' and others' if len(homes) > 3 else ''}, and stands below such a heading"
    close = difflib.get_close_matches(key, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known here: {', '.join(known)}"


_COMMON_TABLES = ("solver", "world")
"""The tables that every scene has: a key of theirs may be looked for in any other."""


def list_tables() -> list[str]:
    """Return the tables of which a scene may have many, those of bodies first."""
    lists = [str(field.alias) for field in Scene.model_fields.values() if field.alias is not None]
    return sorted(lists, key=lambda table: table not in Scene().kinds)


def keys_of(model: type[BaseModel]) -> list[str]:
    """Return the keys of a table."""
    return [field.alias or name for name, field in model.model_fields.items()]


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
