"""Override paths: `--set` and sweeps address every value of a scene."""

import copy
import datetime
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.scene.errors import path_of
from sandbox.scene.files.overrides import AddressError, assign, parse_assignment, parse_path, parse_value

DOCUMENT: dict[str, Any] = {
    "title": "t",
    "world": {"gravity": [0.0, -9.81]},
    "ball": [
        {"name": "cue", "mass": 1.0},
        {"name": "8 ball"},
        {"mass": 3.0},
        {"name": "a.b"},
        {"name": "0", "mass": 9},
    ],
    "wall": [{"points": [[0, 0], [1, 1]]}],
    "post": [],
}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1), ("-1.5e3", -1500.0), ("true", True), ("false", False), ("[1, 0]", [1, 0]), ('"1"', "1"),
        ("'x y'", "x y"),
        ("{a = 1}", {"a": 1}), ("[[0, 1], [2, 3]]", [[0, 1], [2, 3]]), ("1979-05-27", datetime.date(1979, 5, 27)),
        ("leapfrog", "leapfrog"), ("two words", "two words"), ("", ""), ("1 2", "1 2"), ("1\nx = 2", "1\nx = 2"),
        ("1\nvalue = 2", "1\nvalue = 2"), ("0x1F", 31), ("inf", float("inf")), ("a = b", "a = b"), ("[1,", "[1,"),
        ("True", "True"), ("9" * 5000, "9" * 5000), ("[" * 10_000, "[" * 10_000), ("1_000", 1000), (".5", ".5"),
    ],
)  # fmt: skip
def test_value_is_parsed_as_toml_or_else_as_a_string(text: str, value: object) -> None:
    parsed = parse_value(text)
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize(
    ("path", "parts"),
    [
        ("solver.dt", ("solver", "dt")), ("title", ("title",)), ('ball."8 ball".mass', ("ball", "8 ball", "mass")),
        ("ball.8 ball.mass", ("ball", "8 ball", "mass")), ("ball.'a.b'.mass", ("ball", "a.b", "mass")),
        ("""ball.'say "hi"'""", ("ball", 'say "hi"')), ("ball.0.velocity.1", ("ball", "0", "velocity", "1")),
        ("ball.it's.mass", ("ball", "it's", "mass")), ('"a"', ("a",)),
        ("drive[0].rate", ("drive", "0", "rate")), ("ball.cue.velocity[1]", ("ball", "cue", "velocity", "1")),
        ("wall[0].points[1][0]", ("wall", "0", "points", "1", "0")), ("ball.'a[0]'.mass", ("ball", "a[0]", "mass")),
        ("ball.[x]", ("ball", "[x]")), ("a[0]b", ("a[0]b",)),
    ],
)  # fmt: skip
def test_path_is_split_at_dots_outside_quotes(path: str, parts: tuple[str, ...]) -> None:
    assert parse_path(path) == parts


@pytest.mark.parametrize(
    "path", ["", ".", "a.", ".a", "a..b", '"a', "'a.b", '"a"b', 'a."".b', "''", "a.'b'c", "[0]", "a.[0].b"]
)
def test_malformed_path_is_refused(path: str) -> None:
    with pytest.raises(AddressError):
        parse_path(path)


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("solver.dt=0.001", "solver.dt", 0.001), (" a = 1 ", "a", 1), ("a=b=c", "a", "b=c"), ("a=", "a", ""),
        ("""ball."x=y".mass=2""", 'ball."x=y".mass', 2), ("ball.it's.mass=2", "ball.it's.mass", 2),
        ("title='a=b'", "title", "a=b"), ("ball.'=\"'.mass=1", "ball.'=\"'.mass", 1),
    ],
)  # fmt: skip
def test_assignment_is_split_at_the_first_equals_outside_quotes(text: str, key: str, value: object) -> None:
    assert parse_assignment(text) == (key, value)


@pytest.mark.parametrize("text", ["", "a", "=1", "  =1", "solver.dt", "'a=1"])
def test_assignment_without_key_or_equals_is_refused(text: str) -> None:
    with pytest.raises(AddressError, match="KEY=VALUE"):
        parse_assignment(text)


@pytest.mark.parametrize(
    ("path", "location"),
    [
        ("title", ("title",)), ("world.gravity", ("world", "gravity")), ("world.gravity.1", ("world", "gravity", 1)),
        ("world.seed", ("world", "seed")), ("solver.dt", ("solver", "dt")), ("ball.cue.mass", ("ball", 0, "mass")),
        ('ball."8 ball".mass', ("ball", 1, "mass")), ("ball.2.mass", ("ball", 2, "mass")),
        ("ball.'a.b'.mass", ("ball", 3, "mass")), ("ball.0.mass", ("ball", 4, "mass")),
        ("wall.0.points.1.0", ("wall", 0, "points", 1, 0)),
        ("ball.1", ("ball", 1)), ("wall", ("wall",)), ("wall.0", ("wall", 0)),
    ],
)  # fmt: skip
def test_assign_sets_only_the_value_at_the_path(path: str, location: tuple[str | int, ...]) -> None:
    before = copy.deepcopy(DOCUMENT)
    changed, where = assign(DOCUMENT, path, 42)
    assert where == location
    assert before == DOCUMENT
    expected: Any = copy.deepcopy(DOCUMENT)
    node = expected
    for key in location[:-1]:
        node = node.setdefault(key, {}) if isinstance(node, dict) else node[key]
    node[location[-1]] = 42
    assert changed == expected


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("ball.none.mass", "names: cue, 8 ball, ball-3, a.b, 0; numbers: 0 to 4"), ("ball.5.mass", "no element '5'"),
        ("ball.-1.mass", "no element '-1'"), ("wall.x.points", "names: wall-1; numbers: 0"),
        ("title.x", "single value"),
        ("world.gravity.2", "no element '2'"), ("world.gravity.0.x", "single value"), ("a.b.c", "no a"),
        ("world.x.y", "no world.x"), ("ball.cue.x.y", "no ball.cue.x"), ("post.0.mass", "numbers: none"),
        ("ball." + "9" * 5000, "the limit is 1,000"),
        ("ball.\u00b2.mass", "no element"), ("ball.1e0.mass", "no element"),
    ],
)  # fmt: skip
def test_unknown_path_is_refused_with_the_available_names(path: str, words: str) -> None:
    with pytest.raises(AddressError, match=words):
        assign(DOCUMENT, path, 1)


@pytest.mark.parametrize(
    "location",
    [("ball", 0, "mass"), ("ball", 2, "mass"), ("wall", 0, "points", 1, 0), ("world", "gravity", 1), ("ball", 1)],
)
def test_path_of_a_fault_can_be_assigned_to(location: tuple[str | int, ...]) -> None:
    assert assign(DOCUMENT, path_of(location, DOCUMENT), 7)[1] == location


@given(st.text(max_size=40), st.integers())
@example("world." + "a." * 5000 + "b", 1)
def test_any_path_is_assigned_or_refused(path: str, value: int) -> None:
    try:
        changed, location = assign(DOCUMENT, path, value)
    except AddressError as error:
        assert str(error)
    else:
        node: Any = changed
        for key in location:
            node = node[key]
        assert node == value


@given(st.text(min_size=1).filter(lambda name: '"' not in name or "'" not in name))
def test_element_of_any_name_is_addressed_in_quotes(name: str) -> None:
    quote = "'" if '"' in name else '"'
    key, value = parse_assignment(f"ball.{quote}{name}{quote}.mass=2")
    _, where = assign({"ball": [{"name": "other"}, {"name": name}]}, key, value)
    assert where == ("ball", int(name != "other"), "mass")


def test_star_sets_every_element_and_returns_the_location_of_the_list() -> None:
    before = copy.deepcopy(DOCUMENT)
    changed, where = assign(DOCUMENT, "ball.*.restitution", 0.5)
    assert where == ("ball",)
    assert before == DOCUMENT
    assert changed == {**DOCUMENT, "ball": [{**each, "restitution": 0.5} for each in DOCUMENT["ball"]]}


def test_star_works_in_nested_lists() -> None:
    document = {"pinball": {"bumper": [{"name": "a"}, {}], "wall": [{"points": [[0, 0], [1, 2]]}]}}
    changed, where = assign(document, "pinball.bumper.*.speed", 2)
    assert where == ("pinball", "bumper")
    assert changed["pinball"]["bumper"] == [{"name": "a", "speed": 2}, {"speed": 2}]
    assert assign(document, "pinball.wall.*.points.*[1]", 7)[0]["pinball"]["wall"] == [{"points": [[0, 7], [1, 7]]}]
    assert assign({"ball": [{}, {"mass": 1}]}, 'ball."*".mass', 9)[0] == {"ball": [{"mass": 9}, {"mass": 9}]}


def test_element_named_star_takes_precedence() -> None:
    document = {"ball": [{"name": "a"}, {"name": "*"}]}
    changed, where = assign(document, "ball.*.mass", 2)
    assert where == ("ball", 1, "mass")
    assert changed == {"ball": [{"name": "a"}, {"name": "*", "mass": 2}]}


@pytest.mark.parametrize(
    ("document", "path", "words"),
    [
        ({"ball": []}, "ball.*.mass", r"no \[\[ball\]\]"),
        ({"title": "t"}, "ball.*.mass", r"no \[\[ball\]\]"),
        ({"ball": [{"position": [0, 0]}]}, "ball.*.position.2", "no element '2'"),
        ({"ball": [{"mass": 1}]}, "ball.*.mass.x", "single value"),
        ({"ball": [{"mass": 1}]}, "ball.*", "no element"),
        ({"world": {"gravity": [0, 0]}}, "world.*.x", "no world"),
        ({"ball": [3]}, "ball.*.mass", r"\w"),
        ({"pinball": {"bumper": []}}, "pinball.bumper.*.speed", r"no \[\[pinball.bumper\]\]"),
        ({"pinball": {"wall": []}}, "pinball.bumper.*.speed", "no pinball.bumper"),
        ({"ball": [{}]}, "ball.b.shapes.*.x", "no element 'b'"),
    ],
)  # fmt: skip
def test_star_with_an_unknown_path_is_refused(document: dict[str, Any], path: str, words: str) -> None:
    before = copy.deepcopy(document)
    with pytest.raises(AddressError, match=words):
        assign(document, path, 1)
    assert before == document
