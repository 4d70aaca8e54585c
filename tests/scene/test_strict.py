"""Strictness: values in a scene file are never guessed or converted."""

import datetime
from typing import Any

import pytest

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads

BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"


def faults(text: str) -> list[tuple[int | None, str]]:
    with pytest.raises(SceneError) as caught:
        loads(text)
    return [(fault.line, fault.path) for fault in caught.value.faults]


@pytest.mark.parametrize(
    "value",
    [
        '"0.1"', "true", "inf", "-inf", "nan", "1e400", "-1e400", "[1.0]", "{}", "1979-05-27", "07:32:00", "''",
        "1979-05-27T07:32:00Z", "1" + "0" * 400, "-1" + "0" * 4000, "0x" + "f" * 300,
    ],
)  # fmt: skip
@pytest.mark.parametrize("key", ["mass", "angle", "restitution"])
def test_number_of_a_wrong_type_is_refused_at_its_line(key: str, value: str) -> None:
    assert (4, f"ball[0].{key}") in faults(f"{BALL}{key} = {value}\n")


@pytest.mark.parametrize("value", ["1.0", "1.5", "1e3", "true", '"1"', "nan", "inf", "[]", "1979-05-27"])
def test_integer_of_a_wrong_type_is_refused(value: str) -> None:
    assert faults(f"{BALL}[solver]\nsubsteps = {value}\n") == [(5, "solver.substeps")]


@pytest.mark.parametrize("value", ["1", "0", '"true"', "1.0", "[]", "07:32:00"])
def test_boolean_of_a_wrong_type_is_refused(value: str) -> None:
    assert faults(f"{BALL}fixed = {value}\n") == [(4, "ball[0].fixed")]


@pytest.mark.parametrize("value", ["1", "true", "1.5", "[]", "{}", "1979-05-27", "07:32:00", "1979-05-27T07:32:00"])
@pytest.mark.parametrize("key", ["name", "material", "colour"])
def test_text_of_a_wrong_type_is_refused(key: str, value: str) -> None:
    assert (4, f"ball[0].{key}") in faults(f"{BALL}{key} = {value}\n")


@pytest.mark.parametrize(
    "value", ["3", "[1]", "[1, 2, 3]", "[]", '"1, 2"', '["1", 2]', "[true, 1]", "[[0, 0]]", "{x=1}"]
)
def test_vector_of_a_wrong_type_is_refused(value: str) -> None:
    for line, path in faults(f"{BALL}velocity = {value}\n"):
        assert line == 4
        assert path.startswith("ball[0].velocity")


def test_unknown_choice_is_refused_with_the_choices() -> None:
    with pytest.raises(SceneError, match="'explicit_euler', 'semi_implicit_euler'") as caught:
        loads(f'{BALL}[solver]\nintegrator = "euler"\n')
    assert caught.value.faults[0].path == "solver.integrator"


def test_integers_are_accepted_as_floats() -> None:
    ball = loads(BALL).balls[0]
    assert ball.position == (0.0, 0.0)
    assert type(ball.radius) is float


@pytest.mark.parametrize(
    ("typo", "key"),
    [
        ("[[ball]]\nposition=[0,0]\nraduis=1", "radius"), ("[wrold]\nseed=1", "world"), ("[[bal]]\nradius=1", "ball"),
        ("[solver]\nsubstep=1", "substeps"), ("[[balls]]\nradius=1", "ball"), ("tilte='x'", "title"),
        ("[world]\ngravty=[0,0]", "gravity"), ("[[walls]]\npoints=[[0,0],[1,1]]", "wall"),
    ],
)  # fmt: skip
def test_misspelt_key_is_refused_with_a_suggestion(typo: str, key: str) -> None:
    with pytest.raises(SceneError, match=f"did you mean '{key}'"):
        loads(typo)


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("elasticity", "restitution"), ("bounciness", "restitution"), ("pos", "position"), ("vel", "velocity"),
        ("rotation", "angle"), ("Rot", "angle"), ("mu", "friction"),
    ],
)  # fmt: skip
def test_key_of_another_engine_is_refused_with_the_key_here(word: str, key: str) -> None:
    with pytest.raises(SceneError, match=f"{word}: unknown key; did you mean '{key}'"):
        loads(f"{BALL}{word} = 1")


@pytest.mark.parametrize(
    ("word", "table"),
    [("circle", "ball"), ("crate", "box"), ("rectangles", "box"), ("segment", "wall"), ("line", "wall")],
)
def test_table_of_another_engine_is_refused_with_the_table_here(word: str, table: str) -> None:
    with pytest.raises(SceneError, match=f"{word}: unknown key; did you mean '{table}'"):
        loads(f"{BALL}[[{word}]]")


def test_static_is_refused_with_the_keys_of_fixed_elements() -> None:
    with pytest.raises(SceneError, match="static: unknown key; did you mean fixed = true"):
        loads(f"{BALL}static = true")
    with pytest.raises(SceneError, match="static: unknown key; did you mean plane, wall or post"):
        loads(f"{BALL}[[static]]")


def test_unknown_key_without_a_similar_one_lists_the_known_keys() -> None:
    with pytest.raises(SceneError, match=r"zzzz: unknown key; known keys: .*position.*radius"):
        loads(f"{BALL}zzzz = 1")


@pytest.mark.parametrize("plural", ["balls", "planes", "walls", "posts", "grids", "scatters", "emitters", "pairs"])
def test_plural_field_names_are_not_keys_of_a_file(plural: str) -> None:
    assert (4, plural) in faults(f"{BALL}[[{plural}]]\n")
    assert (4, plural) in faults(f"{BALL}[[{plural}]]\nraduis = 1\n")


@pytest.mark.parametrize("kind", ["ball", "plane", "wall", "post", "material", "pair", "grid", "scatter", "emitter"])
def test_single_table_for_an_array_of_tables_is_refused(kind: str) -> None:
    with pytest.raises(SceneError, match=rf"\[\[{kind}\]\]") as caught:
        loads(f"title = 't'\n[{kind}]\nname = 'x'\n")
    assert [(fault.line, fault.path) for fault in caught.value.faults] == [(2, kind)]


@pytest.mark.parametrize("kind", ["world", "solver"])
@pytest.mark.parametrize("value", ["3", "[]", "'x'", "true", "[1]", "[{}]"])
def test_value_that_is_not_a_table_is_refused(kind: str, value: str) -> None:
    assert faults(f"{kind} = {value}\n") == [(1, kind)]


def test_array_of_tables_for_a_single_table_is_refused() -> None:
    assert faults("[[world]]\nseed = 1\n") == [(1, "world")]


def test_all_missing_keys_are_reported() -> None:
    assert set(faults("[[ball]]\n[[plane]]\n[[wall]]\n[[post]]\n[[material]]\n[[pair]]\n[[grid]]\n[[emitter]]\n")) == {
        (1, "ball[0].position"), (1, "ball[0].radius"), (2, "plane[0].point"), (2, "plane[0].normal"),
        (3, "wall[0].points"), (4, "post[0].position"), (4, "post[0].radius"), (5, "material[0].name"),
        (6, "pair[0].between"), (7, "grid[0].radius"), (7, "grid[0].origin"), (7, "grid[0].columns"),
        (7, "grid[0].spacing"), (8, "emitter[0].position"), (8, "emitter[0].count"), (8, "emitter[0].velocity_min"),
        (8, "emitter[0].velocity_max"),
    }  # fmt: skip


@pytest.mark.parametrize(
    "value", [datetime.date(2000, 1, 1), datetime.time(1), datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC)]
)
@pytest.mark.parametrize(
    "document",
    [
        {"title": None},
        {"world": None},
        {"ball": None},
        {"ball": [None]},
        {"pair": [{"between": ["a", None]}]},
        {"x": None},
    ],
)
def test_dates_are_refused_everywhere(document: dict[str, Any], value: object) -> None:
    def with_dates(node: Any) -> Any:
        if isinstance(node, dict):
            return {key: with_dates(inner) for key, inner in node.items()}
        if isinstance(node, list):
            return [with_dates(inner) for inner in node]
        return value if node is None else node

    with pytest.raises(SceneError):
        from_document(with_dates(document))


def test_null_is_refused() -> None:
    for key in ("world", "solver", "ball", "title"):
        with pytest.raises(SceneError):
            from_document({key: None})


def test_scene_is_frozen_hashable_and_compared_by_value() -> None:
    one, two = loads(BALL), loads(f"# the same\n{BALL}")
    assert one.bodies.names == ("ball-1",)  # cached properties do not affect equality
    assert one == two
    assert hash(one) == hash(two)
    assert one != loads(BALL + "mass = 2")
    with pytest.raises(ValueError, match="frozen"):
        one.title = "x"  # type: ignore[misc] # the point of the test


def test_model_in_python_is_as_strict_as_a_file() -> None:
    with pytest.raises(ValueError, match="finite"):
        Scene.model_validate({"world": {"duration": float("nan")}})
