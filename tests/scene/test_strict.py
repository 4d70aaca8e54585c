"""Strictness: values in a scene file are never guessed or converted, nor are settings."""

import datetime
from typing import Any

import pytest

from sandbox.engines.registry import ENGINES
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError, SettingsError
from sandbox.scene.files.load import from_document, loads
from tests.scene.faults import assert_faults, faults_of


def faults(text: str) -> list[tuple[int | None, str]]:
    return [(fault.line, fault.path) for fault in faults_of(text)]


BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"


@pytest.mark.parametrize(
    "value",
    [
        '"0.1"', "true", "inf", "-inf", "nan", "1e400", "-1e400", "[1.0]", "{}", "1979-05-27", "07:32:00", "''",
        "1979-05-27T07:32:00Z", "1" + "0" * 400, "-1" + "0" * 4000, "0x" + "f" * 300,
    ],
)  # fmt: skip
@pytest.mark.parametrize("key", ["mass", "restitution"])
def test_number_of_a_wrong_type_is_refused_at_its_line(key: str, value: str) -> None:
    assert (4, f"ball[0].{key}") in faults(f"{BALL}{key} = {value}\n")


@pytest.mark.parametrize("value", ["1.0", "1.5", "1e3", "true", '"1"', "nan", "inf", "[]", "1979-05-27"])
def test_integer_of_a_wrong_type_is_refused(value: str) -> None:
    assert faults(f"{BALL}[solver]\nsubsteps = {value}\n") == [(5, "solver.substeps")]


@pytest.mark.parametrize("value", ["1", "0", '"true"', "1.0", "[]", "07:32:00"])
def test_boolean_of_a_wrong_type_is_refused(value: str) -> None:
    assert faults(f"{BALL}fixed = {value}\n") == [(4, "ball[0].fixed")]


@pytest.mark.parametrize("value", ["1", "true", "1.5", "[]", "{}", "1979-05-27", "07:32:00", "1979-05-27T07:32:00"])
@pytest.mark.parametrize("key", ["name", "colour"])
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
    text = f'{BALL}[solver]\nintegrator = "euler"\n'
    assert_faults(text, "5: solver.integrator: 'explicit_euler', 'semi_implicit_euler'")


def test_integers_are_accepted_as_floats() -> None:
    ball = loads(BALL).balls[0]
    assert ball.position == (0.0, 0.0)
    assert type(ball.radius) is float


@pytest.mark.parametrize(
    ("typo", "key"),
    [
        ("[[ball]]\nposition=[0,0]\nraduis=1", "'radius'"), ("[wrold]\nseed=1", "'world'"),
        ("[[bal]]\nradius=1", "'ball'"), ("[solver]\nsubstep=1", "'substeps'"), ("tilte='x'", "'title'"),
        # words of other engines
        (f"{BALL}elasticity = 1", "'restitution'"), (f"{BALL}bounciness = 1", "'restitution'"),
        (f"{BALL}pos = 1", "'position'"), (f"{BALL}vel = 1", "'velocity'"), (f"{BALL}Rot = 1", "'angle'"),
        (f"{BALL}mu = 1", "'friction'"), ("[[circle]]", "'ball'"), ("[[crate]]", "'box'"), ("[[rectangles]]", "'box'"),
        ("[[segment]]", "'wall'"), ("[[line]]", "'wall'"),
        (f"{BALL}static = true", "fixed = true"), ("[[static]]", "plane, wall or post"),
    ],
)  # fmt: skip
def test_misspelt_or_foreign_key_is_refused_with_a_suggestion(typo: str, key: str) -> None:
    assert any(f"unknown key; did you mean {key}" in fault.message for fault in faults_of(typo))


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        (f"{BALL}bullet = true", "sandbox check"),
        (f"{BALL}buoyancy = 2.0", "`liquid`"),
        (f"{BALL}lateral_friction = 2.0", "`grip`"),
        ("[[water]]\ndensity = 1000", "`liquid`"),
        (f"{BALL}isSensor = true", r"\[\[sensor\]\]"),
        (f"{BALL}gravityScale = 0.5", "did you mean 'gravity_scale'"),
        (f"{BALL}elevation = 0.5", "`spin`"),
        (f"{BALL}drag = 0.1", "did you mean 'linear_damping'"),
        (f"{BALL}rollingFriction = 0.1", "did you mean 'rolling_resistance'"),
        (f"{BALL}maxVelocity = 3", "did you mean 'max_speed'"),
        (f"{BALL}[[joint]]\nkind = 'LineJoint'\nbetween = ['ball-1']", "did you mean 'wheel'"),
        (f"{BALL}[[joint]]\nkind = 'RevoluteJoint'\nbetween = ['ball-1']", "did you mean 'pivot'"),
        (
            f"{BALL}[[joint]]\nkind = 'FixedJoint'\nbetween = ['ball-1']",
            r"parts of one \[\[body\]\]; kinds of joint: rod",
        ),
    ],
)
def test_feature_of_another_engine_is_refused_with_what_a_scene_has_in_its_place(text: str, remedy: str) -> None:
    with pytest.raises(SceneError, match=remedy):
        loads(text)


def test_unknown_key_without_a_similar_one_lists_the_known_keys() -> None:
    with pytest.raises(SceneError, match=r"zzzz: unknown key; known keys: .*position.*radius"):
        loads(f"{BALL}zzzz = 1")


@pytest.mark.parametrize("plural", ["balls", "planes", "emitters"])
def test_plural_field_names_are_not_keys_of_a_file(plural: str) -> None:
    assert (4, plural) in faults(f"{BALL}[[{plural}]]\n")
    assert (4, plural) in faults(f"{BALL}[[{plural}]]\nraduis = 1\n")


@pytest.mark.parametrize("kind", ["ball", "material", "grid"])
def test_single_table_for_an_array_of_tables_is_refused(kind: str) -> None:
    first = faults_of(f"title = 't'\n[{kind}]\nname = 'x'\n")[0]
    assert (first.line, first.path) == (2, kind)
    assert f"[[{kind}]]" in first.message


@pytest.mark.parametrize("kind", ["world", "solver"])
@pytest.mark.parametrize("value", ["3", "[]", "'x'", "true", "[1]", "[{}]", "[{ seed = 1 }]"])
def test_value_that_is_not_a_table_is_refused(kind: str, value: str) -> None:
    assert faults(f"{kind} = {value}\n") == [(1, kind)]


def test_all_missing_keys_are_reported() -> None:
    assert set(faults("[[ball]]\n[[plane]]\n[[wall]]\n[[post]]\n[[material]]\n[[pair]]\n[[grid]]\n[[emitter]]\n")) == {
        (1, "ball[0].position"), (1, "ball[0].radius"), (2, "plane[0].point"), (2, "plane[0].normal"),
        (3, "wall[0].points"), (4, "post[0].position"), (4, "post[0].radius"), (5, "material[0].name"),
        (6, "pair[0].between"), (7, "grid[0].radius"), (7, "grid[0].origin"), (7, "grid[0].columns"),
        (7, "grid[0].spacing"), (8, "emitter[0].position"), (8, "emitter[0].count"), (8, "emitter[0].velocity_min"),
        (8, "emitter[0].velocity_max"),
    }  # fmt: skip


@pytest.mark.parametrize(
    "value", [datetime.date(2000, 1, 1), datetime.time(1), datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC), None]
)
@pytest.mark.parametrize(
    "document",
    [{"title": None}, {"world": None}, {"ball": None}, {"ball": [None]}, {"pair": [{"between": ["a", None]}]}],
)
def test_dates_and_null_are_refused_everywhere(document: dict[str, Any], value: object) -> None:
    def with_dates(node: Any) -> Any:
        if isinstance(node, dict):
            return {key: with_dates(inner) for key, inner in node.items()}
        if isinstance(node, list):
            return [with_dates(inner) for inner in node]
        return value if node is None else node

    with pytest.raises(SceneError):
        from_document(with_dates(document))


def test_scene_is_frozen_hashable_and_compared_by_value() -> None:
    one, two = loads(BALL), loads(f"# the same\n{BALL}")
    assert one.bodies.names == ("ball-1",)  # cached properties do not affect equality
    assert one == two
    assert hash(one) == hash(two)
    assert one != loads(BALL + "mass = 2")
    with pytest.raises(ValueError, match="frozen"):
        one.title = "x"  # type: ignore[misc] # the point of the test


def test_substep_length_is_dt_over_substeps() -> None:
    assert Settings(dt=0.01, substeps=4).h == 0.01 / 4


def test_replace_changes_only_the_given_settings() -> None:
    before = Settings(dt=0.5, slop=0.1, integrator="rk4")
    after = before.replace(dt=0.25, bias=None)
    assert after == Settings(dt=0.25, slop=0.1, integrator="rk4")
    assert before.dt == 0.5


@pytest.mark.parametrize(
    "changes", [{"dt": 0.0}, {"dt": "0.1"}, {"dt": True}, {"step": 1}, {"substeps": 1.0}, {"dt": float("nan")}]
)
def test_replace_validates_as_strictly_as_a_file(changes: dict[str, object]) -> None:
    (key,) = changes
    with pytest.raises(SettingsError, match=f"^settings: solver.{key}: "):
        Settings().replace(**changes)


def test_settings_left_to_the_engine_are_none() -> None:
    unset = {key for key, value in Settings().model_dump().items() if value is None}
    choices = {"integrator", "detection", "response", "impact", "broad_phase", "joints"}
    contacts = {"slop", "bias", "persistence", "stiffness", "damping", "stretch"}
    assert unset == choices | contacts | {"continuous", "sleeping", "sleep_time", "idle_speed", "workers"}


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_resolved_settings_of_extreme_sizes_and_masses_are_within_bounds(engine: str) -> None:
    corners = [[-1e15, -1e15], [1e15, -1e15], [1e15, 1e15], [-1e15, 1e15]]
    giant = {"position": [0, 0], "points": corners, "mass": 1e30}
    plane = {"point": [0, -2e15], "normal": [0, 1]}
    solver, world = {"dt": 1e-9}, {"duration": 1e-9}
    scene = from_document({"polygon": [giant], "plane": [plane], "solver": solver, "world": world})
    settings = scene.solver if engine == "pymunk" else scene.solver.replace(response="penalty")
    chosen = ENGINES[engine].resolve(scene, settings)
    assert chosen.slop == 1e9
    assert chosen.stiffness == (None if engine == "pymunk" else 1e30)
