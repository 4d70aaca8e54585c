"""Fields of tables: kinds, ranges and units from the models, and text of values."""

import math
import re
from typing import Any, get_origin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball, Emitter, Grid
from sandbox.scene.description.fixed import Wall, Zone
from sandbox.scene.description.forces import Attraction, PlungerDrive, Tyre
from sandbox.scene.description.generators import Cloth, Rope
from sandbox.scene.description.joints import Rod, RotarySpring
from sandbox.scene.description.play import Play
from sandbox.scene.description.world import Kick, Pair, Settings, World
from sandbox.scene.editing.fields import (
    FieldSpec,
    fields_of,
    format_number,
    format_value,
    parse,
    summary,
    unit_of,
)  # fmt: skip
from sandbox.scene.files.expressions import evaluated
from tests.scene.models import models, models_in

SPECS = tuple((model, spec) for model in models() for spec in fields_of(model))
NUMERIC = [spec for _, spec in SPECS if spec.kind in ("number", "integer", "numbers")]


def spec_of(model: type[BaseModel], key: str) -> FieldSpec:
    return next(spec for spec in fields_of(model) if spec.key == key)


def ids(case: tuple[type[BaseModel], FieldSpec]) -> str:
    return f"{case[0].__name__}-{case[1].key}"


@pytest.mark.parametrize("model", models(), ids=lambda model: model.__name__)
def test_there_is_a_field_for_each_key_of_a_model(model: type[BaseModel]) -> None:
    keys = [field.alias or name for name, field in model.model_fields.items()]
    assert list(dict.fromkeys(spec.key.partition(".")[0] for spec in fields_of(model))) == keys
    assert len({spec.key for spec in fields_of(model)}) == len(fields_of(model))


def test_only_lists_of_tables_and_tables_of_games_are_not_edited_as_a_field() -> None:
    """They have sections of their own in the property panel."""
    others = {case[1].key.rpartition(".")[2] for case in SPECS if case[1].kind == "other"}
    tables = {"billiards", "pinball", "terrain", "artillery", "curling"} | {"place", "levels"}  # points, levels by name
    assert others - tables <= {name for name, field in named_fields() if is_list_of_tables(field)}


def named_fields() -> list[tuple[str, FieldInfo]]:
    return [(field.alias or name, field) for model in models() for name, field in model.model_fields.items()]


def is_list_of_tables(field: FieldInfo) -> bool:
    return get_origin(field.annotation) is tuple and bool(list(models_in(field.annotation)))


def test_fields_that_are_edited_have_a_description() -> None:
    assert not [ids(case) for case in SPECS if case[1].kind != "other" and not case[1].description]


@pytest.mark.parametrize(
    ("model", "key", "kind"),
    [
        (Ball, "radius", "number"), (Ball, "position", "numbers"), (Ball, "spin", "numbers"), (Ball, "name", "name"),
        (Ball, "material", "name"), (Ball, "layer", "name"), (Ball, "colour", "text"), (Ball, "fixed", "flag"),
        (Ball, "collides", "choice"), (Grid, "columns", "integer"), (Emitter, "colours", "list"),
        (Wall, "points", "list"),
        (Wall, "kick.speed", "number"), (Wall, "layers", "list"), (Zone, "gravity", "numbers"),
        (Rod, "between", "list"),
        (Rod, "kind", "choice"), (World, "bounds", "list"), (Settings, "continuous", "flag"), (Play, "game", "choice"),
        (Attraction, "toward", "either"), (Play, "spot", "other"), (Scene, "title", "text"),
    ],
)  # fmt: skip
def test_kind(model: type[BaseModel], key: str, kind: str) -> None:
    assert spec_of(model, key).kind == kind


def test_length_choices_default_and_range() -> None:
    position, velocity, spin = (spec_of(Ball, key) for key in ("position", "velocity", "spin"))
    assert (position.length, spin.length, spec_of(Ball, "radius").length) == (2, 3, 0)
    assert position.is_required and not position.is_optional and position.default is None
    assert not velocity.is_required and not velocity.is_optional and velocity.default == (0.0, 0.0)
    assert not spin.is_required and spin.is_optional and spin.default is None
    assert (position.low, position.high) == (-1e16, 1e16)
    assert (velocity.low, velocity.high) == (None, None)
    assert spec_of(Ball, "collides").choices == ("all", "fixed", "none")
    assert spec_of(Ball, "collides").default == "all"
    assert spec_of(PlungerDrive, "kind").choices == ("plunger",)
    duration = spec_of(World, "duration")
    assert (duration.low, duration.is_low_excluded, duration.high, duration.is_high_excluded) == (0, True, 1e9, False)


@pytest.mark.parametrize(
    ("model", "key", "unit"),
    [
        (Ball, "radius", "m"), (Ball, "density", "kg/m²"), (Ball, "angle", "rad"), (Ball, "angular_velocity", "rad/s"),
        (Ball, "restitution", ""), (Ball, "restitution_falloff", "s/m"), (Ball, "surface_speed", "m/s"),
        (World, "linear_drag", "1/s"), (World, "quadratic_drag", "1/m"), (Attraction, "strength", "m³/s²"),
        (RotarySpring, "damping", "N·m·s/rad"), (Kick, "profile", ""), (Settings, "dt", "s"), (Tyre, "slip", "m/(N·s)"),
        (Tyre, "brake", "N"), (Tyre, "steer", "rad"),
    ],
)  # fmt: skip
def test_unit(model: type[BaseModel], key: str, unit: str) -> None:
    assert spec_of(model, key).unit == unit


DIMENSIONLESS = {
    "axis", "ball_restitution", "bias", "bot", "bounce", "brake", "curl", "cushion_friction", "cushion_restitution",
    "damping", "direction", "error", "facing", "friction", "gravity_scale", "height", "hold_ratio", "level", "lift",
    "normal", "one_way", "ratio", "restitution", "return_ratio", "rolling_friction", "rolling_resistance", "roughness",
    "side", "sliding_friction", "spinning_friction", "steer", "stretch", "throttle",
}  # fmt: skip
"""keys of the numbers without a unit, checked by eye; `brake` and `steer` are levels in events"""


def test_every_number_with_a_dimension_has_a_unit() -> None:
    numbers = [
        spec for model, spec in SPECS if spec.kind in ("number", "numbers") and (model, spec.key) != (Play, "speed")
    ]
    without = {spec.key.rpartition(".")[2] for spec in numbers if not spec.unit and spec.key != "play.speed"}
    assert without <= DIMENSIONLESS


def test_unit_needs_its_place_in_the_description() -> None:
    assert unit_of("kg/m²; default: that of the body") == "kg/m²"
    assert unit_of("direction of the cue, rad from +x") == "rad"
    assert unit_of("1 means about 0.3 m in length and 0.1 m sideways") == ""
    assert unit_of("larger, smaller") == ""


def in_range(spec: FieldSpec) -> st.SearchStrategy[Any]:
    """Return the valid values of a numeric field."""
    if spec.kind == "integer":
        low, high = (None if end is None else int(end) for end in (spec.low, spec.high))
        low = low if low is None else low + spec.is_low_excluded
        return st.integers(low, high if high is None else high - spec.is_high_excluded)
    number = st.floats(
        spec.low, spec.high, allow_nan=False, allow_infinity=False, exclude_min=spec.is_low_excluded,
        exclude_max=spec.is_high_excluded,
    )  # fmt: skip
    if spec.kind == "number":
        return number
    return st.lists(number, min_size=spec.length, max_size=spec.length)


def valid(spec: FieldSpec) -> st.SearchStrategy[Any]:
    """Return the valid values of a field that is edited as text."""
    match spec.kind:
        case "choice":
            return st.sampled_from(spec.choices)
        case "flag":
            return st.booleans()
        case "name":
            text = st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1, max_size=20)
            return text.map(str.strip).filter(bool)
        case "text" if spec.pattern:
            return st.from_regex(spec.pattern.removesuffix("$") + r"\Z")
        case "text":
            return st.text(st.characters(exclude_categories=("Cc", "Cs")), min_size=1, max_size=20).map(str.strip)
        case "list":
            assert spec.item is not None
            most = min(spec.min_items + 3, spec.max_items or spec.min_items + 3)
            return st.lists(valid(spec.item), min_size=spec.min_items, max_size=most)
        case "either":
            # as text, a name of numbers is a point
            return st.one_of(*(valid(each) for each in spec.alternatives)).filter(
                lambda value: not isinstance(value, str) or not re.search("[0-9]|pi|π|tau|deg", value)
            )
    return in_range(spec)


@given(st.data())
def test_text_of_any_value_is_read_as_the_same_value(data: st.DataObject) -> None:
    spec = data.draw(st.sampled_from([spec for _, spec in SPECS if spec.kind != "other"]))
    value = data.draw(valid(spec).filter(lambda each: each != ""))
    assert parse(spec, format_value(spec, value)) == value


@pytest.mark.parametrize(
    ("model", "key", "text", "value"),
    [
        (Rod, "between", "a", ["a"]), (Rod, "between", " a ,b c", ["a", "b c"]),
        (Rod, "between", '["a", "b"]', ["a", "b"]),
        (Rod, "between", '"left, rear", b', ["left, rear", "b"]),
        (Attraction, "toward", "1, 2*pi/pi", [1.0, 2.0]), (Attraction, "toward", "sun", "sun"),
        (Cloth, "pins", "top", "top"), (Cloth, "pins", "0, 0; 3, 0", [[0, 0], [3, 0]]), (Cloth, "pins", "[]", []),
        (Rope, "fix", "[]", []), (Rope, "fix", "start", ["start"]),
        (Wall, "points", "0,0;1,0; 1, 1;", [[0, 0], [1, 0], [1, 1]]),
        (World, "bounds", "-1, 0; 2*2, 3", [[-1, 0], [4, 3]]),
        (World, "bounds", "[[-1, 0], [4, 3]]", [[-1, 0], [4, 3]]),
    ],
)  # fmt: skip
def test_lists_and_points_or_names(model: type[BaseModel], key: str, text: str, value: Any) -> None:
    assert parse(spec_of(model, key), text) == value


@pytest.mark.parametrize(
    ("model", "key", "text", "error"),
    [
        (Rod, "between", "a, b, c", "at most 2 of them"), (Rod, "between", "a,,b", "texts with commas"),
        (Rod, "between", '"a', "texts with commas"), (Wall, "points", "0, 0", "at least 2 points"),
        (World, "bounds", "1, 2; 3", "must be 2 numbers"), (Pair, "between", "a", "have 2 of them"),
        (Rope, "fix", "middle", "start or end"), (Cloth, "pins", "0, 0.5", "whole number"),
        (Cloth, "pins", "up", "top or"),
        (Emitter, "colours", "#ffffff, red", "colour such as"),
    ],
)  # fmt: skip
def test_invalid_lists_are_rejected(model: type[BaseModel], key: str, text: str, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        parse(spec_of(model, key), text)


@given(st.data())
def test_parsed_value_is_in_range_or_rejected(data: st.DataObject) -> None:
    spec = data.draw(st.sampled_from([spec for spec in NUMERIC if spec.kind == "number"]))
    value = data.draw(st.floats(allow_nan=False, allow_infinity=False))
    is_low = spec.low is not None and (value < spec.low or (spec.is_low_excluded and value == spec.low))
    is_high = spec.high is not None and (value > spec.high or (spec.is_high_excluded and value == spec.high))
    if is_low or is_high:
        with pytest.raises(ValueError, match=r"^must be "):
            parse(spec, repr(value))
    else:
        assert parse(spec, repr(value)) == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_formatted_number_is_exact_and_never_longer_than_repr(value: float) -> None:
    text = format_number(value)
    assert evaluated(text) == value
    assert len(text) <= len(repr(value))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.0, "2"), (0.1, "0.1"), (-9.81, "-9.81"), (1e16, "1e16"), (1e-9, "1e-9"), (1000.0, "1000"), (0.25, "0.25"),
        (1 / 60, "1/60"), (-1 / 3, "-1/3"),
        (1 / 64, "0.015625"), (2 / 3, "0.6666666666666666"),
        (2.5e6, "2500000"), (3e6, "3e6"), (1.5e-7, "1.5e-7"), (0.0, "0"), (7, "7"), (2**63 - 1, "9223372036854775807"),
    ],
)  # fmt: skip
def test_format_of_numbers(value: float, text: str) -> None:
    assert format_number(value) == text


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [("position", (0.0, 1.5), "0, 1.5"), ("fixed", True, "true"), ("name", "a b", "a b"), ("mass", None, "")],
)
def test_format_of_other_values(key: str, value: Any, text: str) -> None:
    assert format_value(spec_of(Ball, key), value) == text


@given(st.integers(2, 1000), st.sampled_from((-1, 1)))
def test_text_of_a_fraction_is_short_and_exact(denominator: int, sign: int) -> None:
    text = format_number(sign / denominator)
    assert evaluated(text) == sign / denominator
    assert len(text) <= 12


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ((), ""), (None, ""), ([[0, 1]], "1 point"), (["a", "b"], "a, b"), ("sun", "sun"), ([0.0, 1.5], "0, 1.5"),
        ([{"name": "a"}, {"name": "b"}], "2 tables"), ({"speed": 1.0, "profile": "even"}, "speed, profile"),
        (Kick(speed=2.0), "speed"), (Settings(), ""),
    ],
)  # fmt: skip
def test_summary(value: Any, text: str) -> None:
    assert summary(value) == text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3), ("2*pi", math.tau), ("2 pi", math.tau), ("1/60", 1 / 60), ("-(1 + 2) ** 2", -9), ("2^3", 8),
        ("45 deg", math.pi / 4), ("45°", math.pi / 4), ("deg(45)", math.pi / 4), ("90*deg", math.pi / 2), ("−2", -2),
        ("sqrt(2)", math.sqrt(2)), ("sin(30deg)", 0.5), ("cos(0)", 1), ("tau/2", math.pi), ("+.5", 0.5), ("π", math.pi),
        ("007", 7), ("1e-05", 1e-5), ("00.5", 0.5),
    ],
)  # fmt: skip
def test_expression(text: str, value: float) -> None:
    assert evaluated(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "", "x", "1 +", "__import__('os')", "True", "'a'", "1j", "[1]", "1 if 1 else 2", "pi.real", "sqrt(1, 2)", "1 2",
        "sqrt", "1 // 2", "lambda: 1", "(" * 150, "nan", "inf", "1_", "~1", "\x00", "1if 1else 2", "0x10",
    ],
)  # fmt: skip
def test_text_that_is_no_number(text: str) -> None:
    with pytest.raises(ValueError, match="must be a number, such as"):
        evaluated(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1/0", "must not divide by 0"), ("0**-1", "must not divide by 0"), ("sqrt(-1)", "must have a real value"),
        ("(-1)**0.5", "must have a real value"), ("1e999", "must be a finite number"),
        ("9**9**9**9", "must be a finite number"), ("1" * 201, "must have at most 200 characters, has 201"),
    ],
)  # fmt: skip
def test_expression_without_a_value(text: str, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        evaluated(text)
    assert str(caught.value) == message


@given(st.text(alphabet="0123456789.+-*/()episqrtdgco, °^²\x00é'\"[]{}:=", max_size=40))
def test_any_text_is_a_finite_number_or_a_value_error(text: str) -> None:
    try:
        value = evaluated(text)
    except ValueError as error:
        assert str(error).startswith("must ")
    else:
        assert math.isfinite(value)


@pytest.mark.parametrize(
    ("model", "key", "text", "message"),
    [
        (Ball, "restitution", "2", "must be between 0 and 1, is 2"),
        (World, "duration", "0", "must be greater than 0 and at most 1e9, is 0"),
        (World, "seed", "2**63", "must be at least 0 and less than 9223372036854775808, is 9223372036854775808"),
        (World, "seed", "1.5", "must be a whole number, is 1.5"),
        (Ball, "radius", "", "must have a value"),
        (Ball, "position", "1", "must be 2 numbers with commas between them, has 1"),
        (Ball, "position", "1, 2, 3", "must be 2 numbers with commas between them, has 3"),
        (Ball, "position", "1,", "must be 2 numbers with commas between them, has 1"),
        (Ball, "collides", "some", "must be all or fixed or none, is some"),
        (Ball, "fixed", "yes", "must be true or false, is yes"),
        (Ball, "colour", "red", "must be a colour such as #ff8000"),
        (Ball, "name", "a\x07b", "must have no control characters"),
        (Ball, "name", "n" * 201, "must have at most 200 characters, has 201"),
        (Scene, "ball", "1", "cannot be edited as text"),
    ],
)
def test_invalid_text(model: type[BaseModel], key: str, text: str, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        parse(spec_of(model, key), text)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("model", "key", "text", "value"),
    [
        (Ball, "mass", " ", None), (Ball, "velocity", "", None), (Ball, "velocity", "[1, pi]", [1.0, math.pi]),
        (Ball, "mass", "2", 2.0), (Ball, "fixed", "true", True), (Ball, "fixed", "false", False),
        (Ball, "collides", "none", "none"), (Ball, "colour", "#Ff8000", "#Ff8000"),
        (Ball, "name", "  cue ball ", "cue ball"),
        (World, "seed", "2**63 - 1", 2**63 - 1), (World, "seed", "6/2", 3), (World, "seed", "1e3", 1000),
    ],
)  # fmt: skip
def test_valid_text(model: type[BaseModel], key: str, text: str, value: Any) -> None:
    found = parse(spec_of(model, key), text)
    assert (found, type(found)) == (value, type(value))


@given(st.data())
def test_model_accepts_a_parsed_value_of_a_box(data: st.DataObject) -> None:
    spec = data.draw(st.sampled_from([spec for spec in fields_of(Box) if spec.kind in ("number", "numbers")]))
    value = parse(spec, format_value(spec, data.draw(in_range(spec))))
    document, added = {"position": (0.0, 0.0), "size": (1.0, 1.0)}, tuple(value) if isinstance(value, list) else value
    for key in reversed(spec.key.split(".")):  # of a table within the table
        added = {key: added}
    try:
        Box.model_validate({**document, **added})
    except ValidationError as error:
        assert spec.key == "velocity", error  # its length is limited, not its components
