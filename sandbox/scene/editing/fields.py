"""Fields of the tables of a scene file, derived from their models: kind, range, unit, description, and text of values.

Text typed by a user may be an expression, such as `2*pi`, `1/60` or `45 deg`.
"""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from types import NoneType
from typing import Any, Literal, get_args

from pydantic import BaseModel, StringConstraints
from pydantic.fields import FieldInfo

from sandbox.scene.description.base import Colour, Name, is_required
from sandbox.scene.files.expressions import evaluated
from sandbox.scene.files.json_schema import described

FieldKind = Literal["number", "integer", "text", "choice", "flag", "numbers", "name", "list", "either", "other"]

MAX_DECIMALS, MAX_DENOMINATOR = 12, 1000
"""A number with a longer decimal form is written as a fraction with the numerator 1, if it is one."""


@dataclass(frozen=True)
class FieldSpec:
    """A key of a table of a scene file."""

    key: str
    """key in the file; of a table within the table with a dot, such as `kick.speed`"""
    kind: FieldKind
    """`numbers`: array of a fixed length; `name`: name of an element, material or layer; `list`: texts or points;
    `either`: one of several kinds, as a point or a name; `other`: no kind of text, as lists of tables"""
    length: int
    """number of components of `numbers`; 0 for others"""
    choices: tuple[str, ...]
    """values of a `choice`"""
    is_optional: bool
    """whether the model allows None, that is no value"""
    default: Any
    """value without the key; None if the key is required, or if there is no value without it"""
    is_required: bool
    low: float | None
    """smallest value of each number; None without a limit"""
    high: float | None
    """largest value of each number; None without a limit"""
    unit: str
    """such as `m/s`; "" for a number without a dimension"""
    description: str
    is_low_excluded: bool = False
    """whether `low` itself is outside the range"""
    is_high_excluded: bool = False
    """whether `high` itself is outside the range"""
    pattern: str = ""
    """regular expression of a text; "" without one"""
    max_length: int | None = None
    """largest number of characters of a text; None without a limit"""
    item: "FieldSpec | None" = None
    """spec of each item of a `list` or of `numbers`"""
    min_items: int = 0
    """smallest length of a `list`"""
    max_items: int | None = None
    """largest length of a `list`; None without a limit"""
    alternatives: tuple["FieldSpec", ...] = ()
    """specs of the kinds of an `either`"""


@cache
def fields_of(model: type[BaseModel]) -> tuple[FieldSpec, ...]:
    """Return the fields of a model of a table, in the order of the model, those of tables within it in their place."""
    properties = model.model_json_schema(by_alias=True)["properties"]
    descriptions = {name: " ".join(text.split()) for name, text in described(model).items()}
    found: list[FieldSpec] = []
    for name, field in model.model_fields.items():
        key = field.alias or name
        inner = inner_model(field)
        if inner is not None:
            found += [replace(spec, key=f"{key}.{spec.key}", is_required=False) for spec in fields_of(inner)]
            continue
        default = None if is_required(field) else field.get_default(call_default_factory=True)
        is_optional = not is_required(field) and (default is None or NoneType in get_args(field.annotation))
        spec = _spec(key, properties[key], descriptions.get(name, ""))
        found.append(replace(spec, default=default, is_optional=is_optional, is_required=is_required(field)))
    return tuple(found)


def inner_model(field: FieldInfo) -> type[BaseModel] | None:
    """Return the model of a field that is a table, which may be left out; None for other fields."""
    types = [each for each in get_args(field.annotation) or (field.annotation,) if each is not NoneType]
    is_table = len(types) == 1 and isinstance(types[0], type) and issubclass(types[0], BaseModel)
    return types[0] if is_table else None


def _spec(key: str, schema: dict[str, Any], description: str) -> FieldSpec:
    """Return the spec of a required field with a JSON schema."""
    alternatives = [each for each in schema.get("anyOf", [schema]) if each.get("type") != "null"]
    specs = [_spec_of_kind(key, each, description) for each in alternatives]
    if len(specs) == 1:
        return specs[0]
    kind: FieldKind = "other" if any(spec.kind == "other" for spec in specs) else "either"
    return FieldSpec(key, kind, 0, (), False, None, True, None, None, "", description, alternatives=tuple(specs))


def _spec_of_kind(key: str, value: dict[str, Any], description: str) -> FieldSpec:
    """Return the spec of a field with a single kind of values."""
    kind, choices = _kind(value)
    components = value.get("prefixItems", ())
    number = components[0] if kind == "numbers" else value if kind in ("number", "integer") else {}
    is_array = kind in ("list", "numbers")
    item = _spec_of_kind(key, value.get("items") or components[0], description) if is_array else None
    return FieldSpec(
        key,
        kind,
        len(components) if kind == "numbers" else 0,
        choices,
        False,
        None,
        True,
        number.get("minimum", number.get("exclusiveMinimum")),
        number.get("maximum", number.get("exclusiveMaximum")),
        unit_of(description) if number else item.unit if item else "",
        description,
        "exclusiveMinimum" in number,
        "exclusiveMaximum" in number,
        value.get("pattern", "") if kind in ("text", "name") else "",
        value.get("maxLength") if kind in ("text", "name") else None,
        item,
        value.get("minItems", 0) if kind == "list" else 0,
        value.get("maxItems") if kind == "list" else None,
    )


def _pattern_of(annotated: Any) -> str | None:
    """Return the pattern of an annotated type of text."""
    constraints = get_args(annotated)[1]
    assert isinstance(constraints, StringConstraints)
    return str(constraints.pattern)


_ITEM_KINDS = ("text", "name", "choice", "number", "numbers", "list")
"""Kinds of the items of a `list`"""
_NAME_PATTERN, _COLOUR_PATTERN = _pattern_of(Name), _pattern_of(Colour)


def _kind(schema: dict[str, Any]) -> tuple[FieldKind, tuple[str, ...]]:
    """Return the kind of a value with a JSON schema, and its choices."""
    match schema:
        case {"enum": [*choices]} if all(isinstance(each, str) for each in choices):
            return "choice", tuple(choices)
        case {"const": str(choice)}:
            return "choice", (choice,)
        case {"type": "number"}:
            return "number", ()
        case {"type": "integer"}:
            return "integer", ()
        case {"type": "boolean"}:
            return "flag", ()
        case {"type": "string"}:
            return ("name" if schema.get("pattern") == _NAME_PATTERN else "text"), ()
        case {"type": "array", "prefixItems": [first, *others], "minItems": int(least), "maxItems": int(most)}:
            if least == most and all(each == first for each in others):
                kind = _kind(first)[0]
                return "numbers" if kind in ("number", "integer") else "list" if kind in _ITEM_KINDS else "other", ()
        case {"type": "array", "items": dict(item)} if _kind(item)[0] in _ITEM_KINDS:
            return "list", ()
    return "other", ()


_BASE_UNIT = r"(?:(?:kg|m|s|N|J|W|rad|Hz|Pa)[²³⁴]?)"
_PRODUCT = rf"{_BASE_UNIT}(?:·{_BASE_UNIT})*"
_UNIT = re.compile(rf"(?:^|, )((?:1|{_PRODUCT})/(?:\({_PRODUCT}\)|{_PRODUCT})|{_PRODUCT})(?=$|[,;:.]| \(| from )")


def unit_of(description: str) -> str:
    """Return the unit in the description of a number, such as `m/s²` in "gravity, m/s²"; "" without one.

    It stands at the start or after a comma, and before a punctuation mark, a bracket or "from".
    """
    found = _UNIT.search(description)
    return "" if found is None else found[1]


def parse(spec: FieldSpec, text: str) -> Any:
    """Return the value for the file of a text typed by the user; None if the key is to be left out.

    Empty text leaves out a key that is not required. Numbers may be expressions of + - * / ** and brackets, with `pi`,
    `tau`, `deg` (π/180), `sqrt`, `sin` and `cos`. Arrays may be in square brackets; `[]` is an empty list. Semicolons
    stand between points, commas between texts; a text with a comma is in double quotes. Numbers in a `number` or
    `numbers` are floats, unless the model wants integers; arrays are lists.

    Raises:
        ValueError: the text is no valid value; the message says what would be right. Values of kind `other` have no
            text.
    """
    if spec.kind == "other":
        raise ValueError("cannot be edited as text")
    typed = text.strip()
    if not typed:
        if spec.is_required:
            raise ValueError("must have a value")
        return None
    match spec.kind:
        case "number" | "integer":
            return _parse_number(spec, typed)
        case "numbers":
            return _parse_numbers(spec, typed)
        case "choice":
            if typed not in spec.choices:
                raise ValueError(f"must be {' or '.join(spec.choices)}, is {_shortened(typed)}")
            return typed
        case "flag":
            if typed not in ("true", "false"):
                raise ValueError(f"must be true or false, is {_shortened(typed)}")
            return typed == "true"
        case "list":
            return _parse_list(spec, typed)
        case "either":
            return _parse_either(spec, typed)
    return _parse_text(spec, typed)


def _parse_text(spec: FieldSpec, typed: str) -> str:
    if spec.max_length is not None and len(typed) > spec.max_length:
        raise ValueError(f"must have at most {spec.max_length} characters, has {len(typed)}")
    if spec.pattern and re.search(spec.pattern, typed) is None:
        right = "be a colour such as #ff8000" if spec.pattern == _COLOUR_PATTERN else "have no control characters"
        raise ValueError(f"must {right}")
    return typed


def _parse_numbers(spec: FieldSpec, typed: str) -> list[float]:
    if typed.startswith("[") and typed.endswith("]"):
        typed = typed[1:-1]
    parts = [part.strip() for part in typed.split(",")]
    if len(parts) != spec.length or not all(parts):
        given = sum(bool(part) for part in parts)
        raise ValueError(f"must be {spec.length} numbers with commas between them, has {given}")
    assert spec.item is not None
    return [_parse_number(spec.item, part) for part in parts]


def _parse_list(spec: FieldSpec, typed: str) -> list[Any]:
    """Return a list of points, with semicolons or brackets between them, or of texts."""
    assert spec.item is not None
    is_of_arrays = spec.item.kind in ("numbers", "list")
    parts = [] if typed == "[]" else _points(typed) if is_of_arrays else _texts(typed)
    is_of_texts = spec.item.kind in ("text", "name")
    items = [_parse_text(spec.item, part) if is_of_texts else parse(spec.item, part) for part in parts]
    is_fixed = spec.min_items == spec.max_items
    if len(items) < spec.min_items or (spec.max_items is not None and len(items) > spec.max_items):
        noun = "points, with semicolons between them" if is_of_arrays else "of them, with commas between"
        is_short = len(items) < spec.min_items
        bound = "" if is_fixed else "at least " if is_short else "at most "
        raise ValueError(f"must have {bound}{spec.min_items if is_short else spec.max_items} {noun}, has {len(items)}")
    return items


def _points(typed: str) -> list[str]:
    """Return the texts of points: `0, 0; 1, 2` or `[[0, 0], [1, 2]]`."""
    joined = re.sub(r"\]\s*,?\s*\[", ";", typed)
    return [part for each in joined.split(";") if (part := each.strip("[] \t"))]


_TEXT_ITEM = re.compile(r'\s*(?:("(?:[^"\\]|\\.)*")\s*|([^,"][^,]*))(?:,|$)')


def _texts(typed: str) -> list[str]:
    """Return texts with commas between them; those in double quotes may contain commas."""
    if typed.startswith("[") and typed.endswith("]"):
        typed = typed[1:-1]
    found, position = [], 0
    while position < len(typed):
        match = _TEXT_ITEM.match(typed, position)
        if match is None:
            raise ValueError("must be texts with commas between them; one with a comma is in double quotes")
        try:
            found.append(json.loads(match[1]) if match[1] else match[2].strip())
            found[-1].encode("utf-8")
        except ValueError:  # also of half a surrogate pair
            raise ValueError(f"must be a text in double quotes, is {_shortened(match[1])}") from None
        position = match.end()
    return found


def _parse_either(spec: FieldSpec, typed: str) -> Any:
    """Return the value of the first kind whose text it is."""
    errors = []
    for alternative in spec.alternatives:
        try:
            return parse(alternative, typed)
        except ValueError as error:
            errors.append(str(error))
    raise ValueError(", or ".join(dict.fromkeys(errors)))


def _parse_number(spec: FieldSpec, typed: str) -> float:
    """Return a number in the range of a field; an int for an `integer`."""
    value = evaluated(typed)
    if spec.kind == "integer":
        if value != math.floor(value):
            raise ValueError(f"must be a whole number, is {format_number(value)}")
        value = int(value)
    else:
        value = float(value)
    too_low = spec.low is not None and (value < spec.low or (spec.is_low_excluded and value == spec.low))
    too_high = spec.high is not None and (value > spec.high or (spec.is_high_excluded and value == spec.high))
    if too_low or too_high:
        raise ValueError(f"must be {_range(spec)}, is {format_number(value)}")
    return value


def _range(spec: FieldSpec) -> str:
    low = "" if spec.low is None else format_number(spec.low)
    high = "" if spec.high is None else format_number(spec.high)
    if low and high and not spec.is_low_excluded and not spec.is_high_excluded:
        return f"between {low} and {high}"
    least = f"{'greater than' if spec.is_low_excluded else 'at least'} {low}" if low else ""
    most = f"{'less than' if spec.is_high_excluded else 'at most'} {high}" if high else ""
    return " and ".join(filter(None, (least, most)))


def _shortened(text: str) -> str:
    return text if len(text) <= 20 else f"{text[:19]}…"


def format_value(spec: FieldSpec, value: Any) -> str:
    """Return the shortest text that `parse` reads as the value; "" for None. Kind `other` has a summary instead."""
    if value is None:
        return ""
    match spec.kind:
        case "number" | "integer":
            return format_number(value)
        case "numbers":
            return ", ".join(map(format_number, value))
        case "flag":
            return "true" if value else "false"
        case "list":
            return _format_list(spec, value)
        case "either":
            return format_value(_alternative_of(spec, value), value)
        case "other":
            return summary(value)
    return str(value)


def _format_list(spec: FieldSpec, items: Sequence[Any]) -> str:
    assert spec.item is not None
    if not items:
        return "[]"
    if spec.item.kind in ("numbers", "list"):
        return "; ".join(format_value(spec.item, item) for item in items)
    if spec.item.kind == "number":
        return ", ".join(map(format_number, items))
    return ", ".join(
        json.dumps(item, ensure_ascii=False) if item != item.strip() or re.search(r'[,"\[\]]', item) else item
        for item in items
    )


def _alternative_of(spec: FieldSpec, value: Any) -> FieldSpec:
    """Return the kind of an `either` that a value has."""
    kinds = ("text", "name", "choice") if isinstance(value, str) else ("list", "numbers")
    return next(each for each in spec.alternatives if each.kind in kinds)


def format_number(value: float) -> str:
    """Return the shortest text that `evaluated` reads as the value: a decimal number or, if far shorter, `1/60`.

    An exponent is used only where it saves many digits.
    """
    if isinstance(value, int):
        return str(value)
    text = repr(value)
    if len(text) > MAX_DECIMALS and 1 / MAX_DENOMINATOR <= abs(value) < 1:
        denominator = round(1 / abs(value))
        if 1 / denominator == abs(value):
            return f"{'-' if value < 0 else ''}1/{denominator}"
    mantissa, _, exponent = text.partition("e")
    mantissa = mantissa.removesuffix(".0")
    if exponent:
        return f"{mantissa}e{int(exponent)}"
    digits = mantissa.rstrip("0")
    zeros = len(mantissa) - len(digits)
    return f"{digits}e{zeros}" if "." not in mantissa and zeros >= 6 else mantissa


def summary(value: Any) -> str:
    """Return a short text of a value that has no text of its own, such as `5 points`; "" if it is empty."""
    if value is None:
        return ""
    match value:
        case () | []:
            return ""
        case str():
            return value
        case BaseModel():
            return summary(value.model_dump(exclude_defaults=True))
        case dict():
            return ", ".join(map(str, value))
        case list() | tuple():
            if all(isinstance(each, str) for each in value):
                return ", ".join(value)
            if all(isinstance(each, int | float) for each in value):
                return ", ".join(map(format_number, value))
            is_table = isinstance(value[0], dict | BaseModel)
            return f"{len(value)} {'table' if is_table else 'point'}{'s' if len(value) != 1 else ''}"
    return str(value)
