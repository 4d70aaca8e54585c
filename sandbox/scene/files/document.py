"""Documents of scenes: nested dicts and lists, as parsed from TOML or JSON. Conversion, keys of tables, nesting depth.

Parsers, validators and copies recurse a few frames per level, so a text of brackets alone could exhaust the stack or
the memory. The depth is therefore checked first, by functions that do not recurse and take linear time and memory.
"""

import json
import re
from typing import Any, get_args

from pydantic import BaseModel

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.actions import Event, Join, Timed
from sandbox.scene.description.forces import Driven, PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.description.game_tables import lazy_table
from sandbox.scene.description.joints import Joined, Joint
from sandbox.scene.errors import Location


def read_model(document: dict[str, Any]) -> Scene:
    """Validate a scene document. Dates and times are invalid values.

    Raises:
        pydantic.ValidationError: parts have faults.
        ValueError: a number is too large to be written.
    """
    return Scene.model_validate_json(to_json(document), by_alias=True, by_name=False)


def to_json(document: dict[str, Any]) -> str:
    """Return a document as JSON; a date or time, which JSON lacks, becomes a table that no model accepts."""
    return json.dumps(document, default=lambda value: {"a date or time": str(value)})


def to_document(scene: Scene) -> dict[str, Any]:
    """Return a scene as nested dicts and lists without default values."""
    document = scene.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return document or {"title": scene.title}


MAX_DEPTH = 32
"""Largest number of nested tables and arrays, including the document, and of parts of one key. A scene needs 8."""

_BARE, _QUOTED = r"[\w-]++", r'"(?:[^"\\\n]++|\\[^\n])*+"|' r"'[^'\n]*+'"
_LONG_KEY = rf"(?:(?:{_BARE}|{_QUOTED})[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}"
_TEXT = (
    r'"""(?:[^"\\]++|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']++|'(?!''))*+(?:'{3,5}|\Z)"
    rf"|{_QUOTED}|[\"'][^\n]*+"  # an unclosed string ends with its line
    r"|#[^\n]*+"
)
"""Strings and comments, in which brackets and dots do not count."""

_BRACKET = re.compile(rf"(?:[^\"'#\[\]{{}}]++|{_TEXT})*+(?:(?P<open>[\[{{])|(?P<close>[\]}}])|\Z)", re.DOTALL)
"""The next bracket, with everything before it."""
_SEEMS_LONG = re.compile(rf"(?:^|[\[{{,])[ \t]*+{_LONG_KEY}", re.MULTILINE)
"""Finds every key with too many parts quickly, and also such text within strings."""
_KEY = re.compile(rf"(?P<key>(?<![\w-]){_LONG_KEY})|{_TEXT}", re.DOTALL)


class NestingError(ValueError):
    """Values are nested too deeply. `line` is the line in the text, or None."""

    def __init__(self, line: int | None = None) -> None:
        super().__init__(f"nested too deeply: more than {MAX_DEPTH} levels of tables and arrays")
        self.line = line


def check_text(text: str) -> None:
    """Refuse a TOML or JSON text whose brackets are nested, or whose keys have parts, beyond `MAX_DEPTH`.

    The text need not be valid. Keys, inline tables and headings together can still exceed the limit; `check_value`
    finds that in the parsed document.

    Raises:
        NestingError: with the line of the text.
    """
    depth = 0
    for token in _BRACKET.finditer(text):
        kind = token.lastgroup
        if kind == "open":
            depth += 1
            if depth >= MAX_DEPTH:
                raise NestingError(text.count("\n", 0, token.end()) + 1)
        elif kind == "close":
            depth -= 1
    if _SEEMS_LONG.search(text):
        for token in _KEY.finditer(text):
            if token.lastgroup == "key":
                raise NestingError(text.count("\n", 0, token.start()) + 1)


def check_value(value: Any) -> None:
    """Refuse nested dicts, lists and tuples deeper than `MAX_DEPTH`, such as one that contains itself.

    Raises:
        NestingError: they are too deep.
    """
    level = [value] if isinstance(value, dict | list | tuple) else []
    for _ in range(MAX_DEPTH):
        if not level:
            return
        inner = [
            each
            for container in level
            for each in (container.values() if isinstance(container, dict) else container)
            if isinstance(each, dict | list | tuple)
        ]
        level = list({id(each): each for each in inner}.values())  # each container once
    if level:
        raise NestingError


def list_tables() -> list[str]:
    """Return the headings of tables that may occur several times, those of bodies first."""
    lists = [str(field.alias) for field in Scene.model_fields.values() if field.alias is not None]
    return sorted(lists, key=lambda table: table not in Scene().kinds)


def keys_of(model: type[BaseModel]) -> list[str]:
    """Return the keys of a table."""
    return [field.alias or name for name, field in model.model_fields.items()]


def model_at(location: Location) -> type[BaseModel]:
    """Return the model of a table by its location; for joints, drives and events the kind follows the index."""
    model: type[BaseModel] = Scene
    kinds: dict[str, type[BaseModel]] = {}  # of the present table, whose kind comes next
    for key in location:
        if kinds and isinstance(key, str):
            model, kinds = kinds.get(key, model), {}
        elif (model is Scene and key in TAGGED) or (model is Join and key == "joint"):
            kinds, model = TAGGED[str(key)]
        elif isinstance(key, str):
            field = {field.alias or name: field for name, field in model.model_fields.items()}[key]
            table = lazy_table(field)
            annotation = field.annotation if table is None else table.model
            model = next(m for m in (annotation, *get_args(annotation)) if _is_model(m))
    return model


JOINTS: dict[str, type[BaseModel]] = {
    tag: model for model in get_args(get_args(Joint)[0]) for tag in get_args(model.model_fields["kind"].annotation)
}
"""Models of joints by their `kind`."""


DRIVES: dict[str, type[BaseModel]] = {"torque": TorqueDrive, "stroke": StrokeDrive, "plunger": PlungerDrive}
"""Models of drives by their `kind`."""


EVENTS: dict[str, type[BaseModel]] = {
    tag: model for model in get_args(get_args(Event)[0]) for tag in get_args(model.model_fields["kind"].annotation)
}
"""Models of events by their `kind`."""


TAGGED: dict[str, tuple[dict[str, type[BaseModel]], type[BaseModel]]] = {
    "joint": (JOINTS, Joined),
    "drive": (DRIVES, Driven),
    "event": (EVENTS, Timed),
}
"""Tables with a `kind`: models by kind, and the base model of all of them."""


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
