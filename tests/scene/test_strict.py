"""Strictness: nothing in a scene file is guessed at or turned into something else."""

import datetime
from typing import Any

import pytest

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads

BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"


def refused(text: str) -> list[tuple[int | None, str]]:
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
def test_number_of_the_wrong_kind_is_refused_where_it_stands(key: str, value: str) -> None:
    assert (4, f"ball[0].{key}") in refused(f"{BALL}{key} = {value}\n")


@pytest.mark.parametrize("value", ["1.0", "1.5", "1e3", "true", '"1"', "nan", "inf", "[]", "1979-05-27"])
def test_whole_number_of_the_wrong_kind_is_refused(value: str) -> None:
    assert refused(f"{BALL}[solver]\nsubsteps = {value}\n") == [(5, "solver.substeps")]


@pytest.mark.parametrize("value", ["1", "0", '"true"', "1.0", "[]", "07:32:00"])
def test_truth_of_the_wrong_kind_is_refused(value: str) -> None:
    assert refused(f"{BALL}fixed = {value}\n") == [(4, "ball[0].fixed")]


@pytest.mark.parametrize("value", ["1", "true", "1.5", "[]", "{}", "1979-05-27", "07:32:00", "1979-05-27T07:32:00"])
@pytest.mark.parametrize("key", ["name", "material", "colour"])
def test_text_of_the_wrong_kind_is_refused(key: str, value: str) -> None:
    assert (4, f"ball[0].{key}") in refused(f"{BALL}{key} = {value}\n")


@pytest.mark.parametrize(
    "value", ["3", "[1]", "[1, 2, 3]", "[]", '"1, 2"', '["1", 2]', "[true, 1]", "[[0, 0]]", "{x=1}"]
)
def test_vector_of_the_wrong_kind_is_refused(value: str) -> None:
    for line, path in refused(f"{BALL}velocity = {value}\n"):
        assert line == 4
        assert path.startswith("ball[0].velocity")


def test_word_outside_a_choice_names_the_choices() -> None:
    with pytest.raises(SceneError, match="'explicit_euler', 'semi_implicit_euler'") as caught:
        loads(f'{BALL}[solver]\nintegrator = "euler"\n')
    assert caught.value.faults[0].path == "solver.integrator"


def test_integers_serve_as_numbers() -> None:
    ball = loads(BALL).balls[0]
    assert ball.position == (0.0, 0.0)
    assert type(ball.radius) is float


@pytest.mark.parametrize(
    ("typo", "meant"),
    [
        ("[[ball]]\nposition=[0,0]\nraduis=1", "radius"), ("[wrold]\nseed=1", "world"), ("[[bal]]\nradius=1", "ball"),
        ("[solver]\nsubstep=1", "substeps"), ("[[balls]]\nradius=1", "ball"), ("tilte='x'", "title"),
        ("[world]\ngravty=[0,0]", "gravity"), ("[[walls]]\npoints=[[0,0],[1,1]]", "wall"),
    ],
)  # fmt: skip
def test_unknown_key_is_refused_with_the_one_meant(typo: str, meant: str) -> None:
    with pytest.raises(SceneError, match=f"did you mean '{meant}'"):
        loads(typo)


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("elasticity", "restitution"), ("bounciness", "restitution"), ("pos", "position"), ("vel", "velocity"),
        ("rotation", "angle"), ("Rot", "angle"), ("mu", "friction"),
    ],
)  # fmt: skip
def test_word_of_another_engine_is_answered_with_the_key(word: str, key: str) -> None:
    with pytest.raises(SceneError, match=f"{word}: unknown key; did you mean '{key}'"):
        loads(f"{BALL}{word} = 1")


@pytest.mark.parametrize(
    ("word", "table"),
    [("circle", "ball"), ("crate", "box"), ("rectangles", "box"), ("segment", "wall"), ("line", "wall")],
)
def test_table_of_another_engine_is_answered_with_the_table(word: str, table: str) -> None:
    with pytest.raises(SceneError, match=f"{word}: unknown key; did you mean '{table}'"):
        loads(f"{BALL}[[{word}]]")


def test_static_is_answered_with_what_does_not_move() -> None:
    with pytest.raises(SceneError, match="static: unknown key; did you mean fixed = true"):
        loads(f"{BALL}static = true")
    with pytest.raises(SceneError, match="static: unknown key; did you mean plane, wall or post"):
        loads(f"{BALL}[[static]]")


def test_unknown_key_unlike_any_lists_those_there_are() -> None:
    with pytest.raises(SceneError, match=r"zzzz: unknown key; known keys: .*position.*radius"):
        loads(f"{BALL}zzzz = 1")


@pytest.mark.parametrize("plural", ["balls", "planes", "walls", "posts", "grids", "scatters", "emitters", "pairs"])
def test_names_of_the_model_are_no_keys_of_a_file(plural: str) -> None:
    assert (4, plural) in refused(f"{BALL}[[{plural}]]\n")
    assert (4, plural) in refused(f"{BALL}[[{plural}]]\nraduis = 1\n")


@pytest.mark.parametrize("kind", ["ball", "plane", "wall", "post", "material", "pair", "grid", "scatter", "emitter"])
def test_single_table_where_several_may_stand_says_so(kind: str) -> None:
    with pytest.raises(SceneError, match=rf"\[\[{kind}\]\]") as caught:
        loads(f"title = 't'\n[{kind}]\nname = 'x'\n")
    assert [(fault.line, fault.path) for fault in caught.value.faults] == [(2, kind)]


@pytest.mark.parametrize("kind", ["world", "solver"])
@pytest.mark.parametrize("value", ["3", "[]", "'x'", "true", "[1]", "[{}]"])
def test_other_value_where_a_table_stands_is_refused(kind: str, value: str) -> None:
    assert refused(f"{kind} = {value}\n") == [(1, kind)]


def test_several_tables_where_one_stands_are_refused() -> None:
    assert refused("[[world]]\nseed = 1\n") == [(1, "world")]


def test_missing_keys_are_all_named() -> None:
    assert set(refused("[[ball]]\n[[plane]]\n[[wall]]\n[[post]]\n[[material]]\n[[pair]]\n[[grid]]\n[[emitter]]\n")) == {
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
    def dated(here: Any) -> Any:
        if isinstance(here, dict):
            return {key: dated(inner) for key, inner in here.items()}
        if isinstance(here, list):
            return [dated(inner) for inner in here]
        return value if here is None else here

    with pytest.raises(SceneError):
        from_document(dated(document))


def test_null_is_no_table() -> None:
    for key in ("world", "solver", "ball", "title"):
        with pytest.raises(SceneError):
            from_document({key: None})


def test_scene_is_frozen_hashable_and_compares_by_what_it_says() -> None:
    one, two = loads(BALL), loads(f"# the same\n{BALL}")
    assert one.bodies.names == ("ball-1",)  # what is worked out from it makes no difference
    assert one == two
    assert hash(one) == hash(two)
    assert one != loads(BALL + "mass = 2")
    with pytest.raises(ValueError, match="frozen"):
        one.title = "x"  # type: ignore[misc] # the point of the test


def test_model_refuses_in_python_what_a_file_would() -> None:
    with pytest.raises(ValueError, match="finite"):
        Scene.model_validate({"world": {"duration": float("nan")}})
