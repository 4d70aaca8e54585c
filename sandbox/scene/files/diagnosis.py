"""Messages for the faults of a file, and checks of the valid parts of a file with faults."""

import copy
import difflib
import math
import re
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, get_args, get_origin

from pydantic import ValidationError

from sandbox.game_names import game_names
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Wording, is_required
from sandbox.scene.description.game_tables import PRESETS, has_preset
from sandbox.scene.errors import EXPECTED, LocatedMessage, Location, PathKey, shown, shown_input
from sandbox.scene.files.document import TAGGED, keys_of, list_tables, model_at, read_model
from sandbox.scene.files.expressions import evaluated
from sandbox.scene.files.presets import expanded_document, stated_location
from sandbox.scene.files.toml_mistakes import number_remedy
from sandbox.scene.validate.scene import crosscheck

_RANGES = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
"""Violated bound of each type of pydantic error."""

_LARGE = 1e5
"""Bounds beyond this only protect the engines from extreme values: a message states such a bound only if it is the
violated one. The same holds for a smallest positive value below its reciprocal."""

_NAME_LISTS = ("categories", "mask", "layers")
"""Keys whose values are lists of names"""

_DEGREES = 720
"""Largest magnitude, two turns, that may be an angle given in degrees by mistake."""

_RAD = re.compile(r"\brad\b(?!/)")
"""rad, but not rad/s"""


def faults_of(document: dict[str, Any], error: ValidationError) -> list[LocatedMessage]:
    """Return the faults of a document that its model refuses, and those of its valid parts."""
    errors = [each for each in error.errors(include_url=False) if not _is_long_enough(each)]
    wrong = [tuple(details["loc"]) for details in errors]
    return [*map(explain, errors), *check_valid_remainder(document, wrong)]


def _is_long_enough(details: Any) -> bool:
    """Return whether an array is long enough; pydantic counts only the elements without faults."""
    return bool(details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"])


def explain(details: Any) -> LocatedMessage:
    """Return the location of a pydantic error, and a message with the fault and the valid values."""
    location = location_of(details)
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if location[:1] == ("cloth",) and location[2:3] == ("pins",):
        return location[:3], "must be 'top', 'corners', 'left', or columns and rows of nodes, such as [[0, 0], [9, 0]]"
    if location[:1] == ("attraction",) and location[2:3] == ("toward",) and (kind != "missing" or len(location) > 3):
        return location[:3], "must be a position, such as [0.0, 0.0], or the name of a body"
    if kind == "missing":
        if isinstance(location[-1], int):
            return location[:-1], _missing_elements(details)
        return location, "is missing; this key is required"
    if kind == "extra_forbidden":
        return location, f"unknown key; {_known_keys(tuple(details['loc']))}"
    if kind == "json_invalid":
        return location, f"the scene cannot be read: {context['error']}"
    if kind == "union_tag_not_found":
        return location, f"is missing; {_one_of(location)}"
    if kind == "union_tag_invalid":
        return location, f"is {shown(context['tag'])}; {_one_of(location, context['tag'])}"
    if kind == "value_error":
        return location, str(context["error"])
    if kind == "string_pattern_mismatch":
        expected = "text '#rrggbb'" if location[-1] == "colour" else "text without control characters"
    elif kind == "tuple_type" and len(location) == 1:
        expected = f"tables, each under a heading [[{location[0]}]]"
    elif kind == "tuple_type" and location[-1] in _NAME_LISTS:
        expected = 'an array of names, such as ["a", "b"]'
    elif kind in ("model_type", "model_attributes_type") and location[-1] == "kick":
        expected = "a table, such as { speed = 3.0 }"
    elif location[:1] == ("joint",) and location[-1] == "between":
        expected = 'the name of one body or of two, such as ["a", "b"]'
    elif kind == "too_short" and isinstance(value, dict):
        expected = "a table that is not empty"
    elif kind in ("too_short", "too_long") and location[-1] != "points":
        expected = f"an array of {_length(tuple(details['loc']), context)}"
    elif kind in _RANGES:
        expected = _range(tuple(details["loc"]), _RANGES[kind], context, value)
    elif kind in EXPECTED:
        expected = EXPECTED[kind].format(**context)
    else:
        expected = details["msg"].removeprefix("Input should be ")
    message = f"must be {expected}, is {shown_input(details)}"
    if kind in _RANGES and abs(value) <= _DEGREES and _is_angle(tuple(details["loc"])):
        message += f"; angles are in radians, {value:g}° is {math.radians(value):.4g}"
    elif kind in ("float_type", "int_type") and isinstance(value, str):
        message += _number_in_quotes(value)
    elif kind == "less_than_equal" and location[-1] == "restitution" and location[0] in ("wall", "post"):
        message += "; walls and posts add speed with kick = { speed = … }, in m/s"
    elif location == ("play", "game") and isinstance(value, str):
        close = difflib.get_close_matches(value, game_names(), n=1)
        message += f"; did you mean {close[0]!r}?" if close else "; if another package has this game, install it"
    return location, message


def _number_in_quotes(text: str) -> str:
    """Return the remedy for a number that is given as text, such as `"1/60"` or `"3 s"`; "" for other texts."""
    if (remedy := number_remedy(text)) is not None:
        return f"; {remedy[0]}: {remedy[1]}"
    try:
        return f"; write {evaluated(text):g} without quotes"
    except ValueError:
        return ""


def explained(error: ValidationError, location: Location) -> list[LocatedMessage]:
    """Return location and message of each error of a part of a scene that was validated by itself.

    Args:
        error: its locations are relative to the part.
        location: of the part in the document.
    """
    return [explain({**each, "loc": (*location, *each["loc"])}) for each in error.errors(include_url=False)]


def _missing_elements(details: Any) -> str:
    """Return the message for an array with too few values: how many it must have, and how many it has."""
    location = tuple(details["loc"])
    required = len(get_args(_annotation_at(location[:-1]))) or location[-1] + 1
    has = len(details["input"])
    field = _field_at(location[:-1])
    for each in () if field is None else field.metadata:
        if isinstance(each, Wording):
            return f"must be {required} {each.text}; has {has}"
    return f"must be an array of {required}, has {has}"


def _length(location: Location, context: Any) -> str:
    """Return the valid lengths of an array in words; pydantic's error has only one bound."""
    for each in _bounds(location):
        low, high = each.get("min_length"), each.get("max_length")
        if low != high and context.get("min_length", low) == low and context.get("max_length", high) == high:
            return f"{low} or {high}" if low is not None and high == low + 1 else f"{low or 0} to {high}"
    return str(context.get("max_length", context.get("min_length")))


def _range(location: Location, violated: str, context: Any, value: float) -> str:
    """Return in words the valid numbers at a location of which one bound was `violated`.

    Both bounds are given if both are of a usual size, else the one that was violated.
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
"""The bounds of a value by pydantic's names."""


def _bounds(location: Location) -> Iterator[dict[str, float]]:
    """Yield the bounds, by their `_KEYS`, of a field and of the elements of its value."""
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
    """Return the field at a location; None if its value may have one of several forms."""
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
    """Return the type at a location within arrays of fixed length; None elsewhere."""
    field = _field_at(location)
    annotation = None if field is None else field.annotation
    last = max(k for k, key in enumerate(location) if isinstance(key, str))
    for key in (None, *location[last + 1 :]):  # None: the field itself
        if key is not None:
            inner = get_args(annotation)
            if not inner:
                return None
            annotation = inner[0] if inner[-1] is Ellipsis else inner[int(key)] if int(key) < len(inner) else None
        while get_origin(annotation) is not tuple and get_args(annotation):  # Annotated or optional
            annotation = get_args(annotation)[0]
    return annotation if Ellipsis not in get_args(annotation) else None


def _is_angle(location: Location) -> bool:
    """Return whether the value at a location is in rad, according to the docstring of its field."""
    from sandbox.scene.files.json_schema import docstrings  # reads source files; imported only if needed

    last = max(k for k, key in enumerate(location) if isinstance(key, str))
    try:
        model = model_at(location[:last])
    except (KeyError, StopIteration):  # the value may have one of several forms
        return False
    texts = docstrings(model)
    name = next((name for name, field in model.model_fields.items() if (field.alias or name) == location[last]), "")
    return _RAD.search(texts.get(name, "")) is not None


def location_of(details: Any) -> Location:
    """Return the location of a pydantic error in the document; for joints and drives the tag is removed."""
    location: Location = tuple(details["loc"])
    if len(location) > 2 and location[0] in TAGGED:
        return location[:2] + location[3:]
    if details["type"] in ("union_tag_invalid", "union_tag_not_found"):
        return (*location, "kind")
    return location


def _known_keys(location: Location) -> str:
    """Return the valid keys at a location, or the key that was probably meant, there or in another table."""
    key, known = str(location[-1]), keys_of(model_at(location[:-1]))
    if key in ("engine", "engines"):
        return "the engine is not part of a scene; choose it with --engine NAME"
    for table in _COMMON_TABLES:
        if key in keys_of(model_at((table,))):
            return f"did you mean {table}.{key}?"
    if len(location) == 1:
        tables = [table for table in list_tables() if key in keys_of(model_at((table, 0)))]
        if tables:
            headings = ", ".join(f"[[{table}]]" for table in tables[:3])
            return f"it is a key of {headings}{' and others' if len(tables) > 3 else ''}; put it under that heading"
    word = key.lower()
    if word == "static":
        suggestion = "fixed = true" if "fixed" in known else "plane, wall or post, or a body with fixed = true"
        return f"did you mean {suggestion}?"
    if location[0] not in _COMMON_TABLES and (remedy := _ELSEWHERE.get(re.sub(r"[^a-z]|^is", "", word))):
        return remedy
    same = [name for name, words in _SYNONYMS.items() if name in known and {word, word.removesuffix("s")} & words]
    close = same or difflib.get_close_matches(key, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known keys: {', '.join(known)}"


_SYNONYMS: dict[str, set[str]] = {
    "ball": {"circle", "disc", "disk", "sphere"},
    "box": {"crate", "rect", "rectangle", "square"},
    "plane": {"floor", "ground"},
    "wall": {"edge", "line", "segment"},
    "position": {"pos", "xy"},
    "velocity": {"speed", "vel"},
    "angle": {"rot", "rotation"},
    "angular_velocity": {"angvel", "omega"},
    "restitution": {"bounce", "bounciness", "elasticity"},
    "friction": {"friction_coefficient", "mu"},
    "rolling_resistance": {"rollingresistance", "rolling_friction", "rollingfriction"},
    "mass": {"density", "weight"},
    "period": {"cycle", "time"},
    "repeat": {"loop", "mode", "pingpong"},
    "easing": {"ease", "interpolation", "transition"},
    "pause": {"dwell", "wait"},
    "start": {"delay", "offset", "phase"},
    "gravity_scale": {"gravityscale", "gravity"},
    "linear_damping": {"lineardamping", "damping", "linear_drag", "lineardrag", "drag"},
    "angular_damping": {"angulardamping", "angular_drag", "angulardrag"},
    "max_speed": {"maxspeed", "max_velocity", "maxvelocity", "speed_limit", "velocity_limit"},
    "max_angular_velocity": {"maxangularvelocity", "max_angular_speed", "max_spin"},
}
"""Keys of the scene file, and words that other engines and file formats use for them."""

_FAST = (
    "whether fast bodies miss contacts depends on the engine and [solver]: exact misses none, reference none with "
    'detection = "swept", box2d none with static objects; for pymunk, `sandbox check` states the dt'
)
_SENSOR = "a [[sensor]] detects the shapes that overlap it; its key `body` names the body that it moves with"
_PATH = "a body with kinematic = true moves along a `path`, such as { points = [[0, 0], [4, 0]], period = 4.0 }"
_LIQUID = "a [[zone]] with `points` can have a `liquid`, such as { density = 1000.0, linear_drag = 500.0 }"
_TYRE = "a [[tyre]] gives a body seen from above a rolling direction and a `grip`, the largest force of its friction, N"
_ELSEWHERE = {
    "bullet": _FAST,
    "ccd": _FAST,
    "continuouscollision": _FAST,
    "sensor": _SENSOR,
    "trigger": _SENSOR,
    "area": _SENSOR,
    **dict.fromkeys(("buoyancy", "buoyancycontroller", "water", "fluid", "fluiddensity", "liquid"), _LIQUID),
    **dict.fromkeys(("tire", "tyre", "grip", "lateralfriction", "sidewaysfriction", "anisotropicfriction"), _TYRE),
    "elevation": "a cue is level; state `velocity` and `spin`, [x, y, z] in rad/s, that the ball has after the stroke",
    **dict.fromkeys(("waypoints", "patrol", "patrolpoints", "tween", "keyframes", "movingplatform"), _PATH),
    **dict.fromkeys(("boundaryleft", "boundaryright", "boundarytop", "boundarybottom", "changex", "changey"), _PATH),
}
"""Features that bodies have in other engines, in letters only and without `is`, and what a scene has in their place"""

_OTHER_JOINTS = {
    "slider": "did you mean 'prismatic', or 'groove', in which a body also turns?",
    "line": "did you mean 'wheel', or 'groove' without its spring?",
    "suspension": "did you mean 'wheel'?",
    "revolute": "did you mean 'pivot'?",
    "hinge": "did you mean 'pivot'?",
    "distance": "did you mean 'rod', 'slide' with least and most, or 'spring'?",
    "rope": "did you mean 'slide' with most, or a [[rope]] of links?",
    "fixed": "did you mean 'weld'? Shapes that never come apart are the parts of one [[body]];",
}
"""Joints of other engines, in letters only and without `joint`, and what a scene has in their place"""

_COMMON_TABLES = ("solver", "world")
"""Tables that every scene has; their keys are often misplaced in others."""


def _one_of(location: Location, tag: object = "") -> str:
    """Return the kinds of joints or drives, after the one that a tag of another engine means."""
    word = re.sub(r"[^a-z]|joint", "", str(tag).lower())
    remedy = f"{_OTHER_JOINTS[word]} " if location[0] == "joint" and word in _OTHER_JOINTS else ""
    return f"{remedy}kinds of {location[0]}: {', '.join(TAGGED[str(location[0])][0])}"


PLACEHOLDERS: dict[str, Any] = {
    "position": [0.0, 0.0],
    "point": [0.0, 0.0],
    "normal": [0.0, 1.0],
    "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "radius": 1.0,
    "size": [1.0, 1.0],
    "length": 1.0,
    "origin": [0.0, 0.0],
    "spacing": [10.0, 10.0],
    "columns": 1,
    "rows": 1,
    "base": [0.0, 0.0],
    "corner": [0.0, 0.0],
    "start": [0.0, 0.0],
    "end": [1.0, 0.0],
    "links": 1,
    "count": 1,
    "lower": [0.0, 0.0],
    "upper": [1.0, 1.0],
    "velocity_min": [0.0, 0.0],
    "velocity_max": [0.0, 0.0],
}
"""Values for required keys, in place of faulty ones."""

NEUTRAL_VALUES: dict[str, dict[str, Any]] = {
    "plane": {"point": [0.0, -1e16], "normal": [0.0, 1.0]},
    "world": {"duration": 1e-6},
    "pocket": {"position": [1e16, 1e16], "radius": 1e-9},
    **{kind: {"collides": "none"} for kind in Scene().kinds},
}
"""Further values for a table with a fault, so that it causes no consequential faults."""

_TABLES = {field.alias or name for name, field in Scene.model_fields.items()} - {"title", "about"}


_COMMON_LOCATIONS = {("world",), ("solver",), ("play",)}
"""Tables that every scene has: one that is no table at all is taken as left out."""

REFERENCING_TABLES = {("joint",), ("attraction",), ("thrust",), ("tyre",), ("drive",), ("shot",), ("sensor",)}
"""Tables that refer to bodies, and to which nothing refers: faulty ones are omitted."""

_NAMES_IN_EVENTS = ("joint", "levels", "thrust", "tyre", "drive")
"""Keys with which events name elements of those tables"""

PARTS = ("ball", "box", "capsule", "polygon")
"""Tables of the parts of a body, which needs at least one."""

INDEPENDENT_KEYS = {
    "material", "name", "between", "normal", "velocity", "angular_velocity", "kinematic", "fixed_rotation", "lift",
    "kick", "closed",
}  # fmt: skip
"""Keys whose faults no placeholder causes: they are reported even for an element with other faults."""


def check_valid_remainder(document: dict[str, Any], wrong: Iterable[Location]) -> list[LocatedMessage]:
    """Cross-check a document whose values at `wrong` are faulty.

    These values are removed, or replaced by placeholders if required. Faults of the elements that they belong to are
    then dropped, except those of independent keys. The result is empty if the faults do not allow a reliable check.
    """
    document = copy.deepcopy(document)
    touched: set[Location] = set()
    wrong = list(wrong)
    single = [location[0] for location in wrong if _is_single_table(document, location)]
    if single:
        return _faults_within(document, single)
    if () in wrong or any(location[:1] == (key,) for location in wrong for key in PRESETS):
        return []  # the document, or the preset that makes most of it, cannot be read
    stated_elements = {key: document[key] for (key,) in REFERENCING_TABLES if key in document}
    kept = _without_faulty(document, wrong)
    is_complete = all(
        isinstance(each, list) and len(each) == len(kept.get(key, ())) for key, each in stated_elements.items()
    )
    for location in wrong:
        if location[:1] in REFERENCING_TABLES:
            continue
        if len(location) == 1 and location[0] in document and location[0] not in _TABLES:
            if difflib.get_close_matches(str(location[0]), _TABLES, n=1) == ["material"]:
                return []  # many references would appear to be missing
            del document[location[0]]  # an unknown key or a title: nothing depends on it
            continue
        if location in _COMMON_LOCATIONS:
            document[str(location[0])] = NEUTRAL_VALUES.get(str(location[0]), {})
            touched.add(location)
            continue
        depth = 2 if len(location) > 1 and isinstance(location[1], int) else 1
        holder: Any = document
        for key in location[:depth]:
            holder = holder[key]
        if len(location) <= depth or not isinstance(holder, dict):
            return []
        holder.pop(location[depth], None)
        if "duration" not in holder:
            is_flat = location[0] == "plane" and holder.get("normal") in ([0, 0], [0.0, 0.0])  # a fault of its own
            neutral = NEUTRAL_VALUES.get(str(location[0]), {})
            holder.update({key: value for key, value in neutral.items() if key != "normal" or not is_flat})
        touched.add(location[:depth])
        if location[0] == "body" and not any(holder.get(part) for part in PARTS):
            holder["ball"] = [{"radius": 1.0}]
        for name, field in model_at(location[:depth]).model_fields.items():
            if is_required(field) and name not in holder and name in PLACEHOLDERS:
                holder[name] = PLACEHOLDERS[name]
    stated = document
    if has_preset(stated):
        document = expanded_document(stated) or {}
    try:
        scene = read_model(document)
    except ValueError:
        return []
    found = [f for f in crosscheck(scene) if touched.isdisjoint((f[0][:1], f[0][:2])) or _is_independent(f[0])]
    if not is_complete:  # events may name what was omitted
        found = [f for f in found if f[0][0] != "event" or len(f[0]) < 3 or f[0][2] not in _NAMES_IN_EVENTS]
    if document is not stated:
        found = [(stated_location(location, document, stated), message) for location, message in found]
    return [(_original_index(location, kept), message) for location, message in found]


def _is_independent(location: Location) -> bool:
    """Return whether no placeholder in an element can cause the fault at a location in it."""
    return len(location) > 2 and (location[2] in INDEPENDENT_KEYS or (location[0], location[2]) == ("wall", "points"))


def _is_single_table(document: dict[str, Any], location: Location) -> bool:
    """Return whether a location is that of a table such as [ball] where a list of tables, [[ball]], is needed."""
    return len(location) == 1 and location[0] in list_tables() and isinstance(document.get(str(location[0])), dict)


def _faults_within(document: dict[str, Any], single: list[PathKey]) -> list[LocatedMessage]:
    """Return the further faults of a document in which some tables are single that must be lists."""
    listed = {key: [value] if key in single else value for key, value in document.items()}
    try:
        found = crosscheck(read_model(listed))
    except ValidationError as error:
        found = faults_of(listed, error)
    except ValueError:
        return []
    return [((key, *location[2:]) if (key := location[:1][0]) in single else location, m) for location, m in found]


def _without_faulty(document: dict[str, Any], wrong: list[Location]) -> dict[str, list[int]]:
    """Remove faulty joints and other referencing tables; return the original indices of those that remain.

    All of them are removed if a body's name may be faulty, because they would appear to refer to a missing body.
    """
    nameless = any(_may_hide_name(location) for location in wrong)
    kept: dict[str, list[int]] = {}
    for (key,) in REFERENCING_TABLES:
        elements = document.get(key)
        faulty = [location for location in wrong if location[0] == key]
        if nameless or not isinstance(elements, list) or any(len(location) < 2 for location in faulty):
            document.pop(key, None)
            continue
        removed = {location[1] for location in faulty}
        kept[key] = [k for k in range(len(elements)) if k not in removed]
        document[key] = [elements[k] for k in kept[key]]
    return kept


def _may_hide_name(location: Location) -> bool:
    """Return whether a fault may be the reason that a body is not found by its name."""
    if len(location) < 2:
        return location not in (("title",), ("about",), *REFERENCING_TABLES)
    key = str(location[2]) if len(location) == 3 else ""
    return location[0] in Scene().kinds and bool(difflib.get_close_matches("name", [key]))


def _original_index(location: Location, kept: dict[str, list[int]]) -> Location:
    """Return a location with the index that a referencing table has in the whole document."""
    if location[:1] in REFERENCING_TABLES and len(location) > 1:
        return (location[0], kept[str(location[0])][int(location[1])], *location[2:])
    return location
