"""Games for pymunk 6 run with its names: calls and motion are those of pymunk 6, and of the same game for pymunk 7."""

import gc
import importlib
import itertools
import json
import pickle
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pymunk
import pytest

from sandbox.pymunk_capture.pymunk6 import PHASES, pymunk6_names
from sandbox.pymunk_capture.removed_names import removed_name
from sandbox.recording import Recording
from tests.cli.calling import call, json_of
from tools.oracles.pymunk6 import CASES, case_of, play

BALL, FLOOR, OTHER = 1, 2, 3
STEPS = 150
DT = 1 / 60


@pytest.fixture
def names() -> Iterator[None]:
    with pymunk6_names():
        yield


@pytest.mark.parametrize("case", json.loads(CASES.read_text())["games"], ids=lambda case: str(case["seed"]))
def test_callbacks_are_called_as_by_pymunk_6(case: dict[str, Any], names: None) -> None:
    # figures of pymunk 6.11.1, written by tools/oracles/pymunk6.py
    assert case_of(case["seed"], play(case["seed"])) == case


def bounce() -> pymunk.Space:
    """Return a space with a ball that bounces on a floor beside a still box."""
    space = pymunk.Space()
    space.gravity = (0, -500)
    floor = pymunk.Segment(space.static_body, (-200, 0), (200, 0), 2)
    ball = pymunk.Body(1, 20)
    ball.position, ball.velocity = (-40, 60), (60, 0)
    disc = pymunk.Circle(ball, 8)
    box = pymunk.Body(2, 200)
    box.position = (40, 12)
    square = pymunk.Poly.create_box(box, (20, 20))
    for shape, kind in ((floor, FLOOR), (disc, BALL), (square, OTHER)):
        shape.elasticity, shape.friction, shape.collision_type = 0.8, 0.5, kind
    space.add(floor, ball, disc, box, square)
    return space


Log = list[tuple[str, int, int]]


def noting(log: Log, name: str, *answers: bool | None) -> Callable[..., Any]:
    """Return a callback for pymunk 6 that notes the types of its shapes, and gives the answers in turn."""
    turn = itertools.cycle(answers)

    def called(arbiter: pymunk.Arbiter, space: pymunk.Space, data: Any) -> Any:
        a, b = arbiter.shapes
        log.append((name, a.collision_type, b.collision_type))
        return next(turn, None)

    return called


def deciding(log: Log, name: str, *answers: bool) -> Callable[..., None]:
    """Return the same callback for pymunk 7."""
    called = noting(log, name, *answers)

    def decided(arbiter: pymunk.Arbiter, space: pymunk.Space, data: Any) -> None:
        arbiter.process_collision = called(arbiter, space, data)

    return decided


def motion(space: pymunk.Space) -> list[tuple[float, ...]]:
    """Return the states of all bodies after each step."""
    states = []
    for _ in range(STEPS):
        space.step(DT)
        states.append(tuple(v for each in space.bodies for v in (*each.position, *each.velocity, each.angle)))
    return states


def test_begin_that_returns_false_lets_the_ball_through(names: None) -> None:
    space, plain = bounce(), bounce()
    log: list[Any] = []
    expected: list[Any] = []
    handler = space.add_collision_handler(BALL, FLOOR)
    for phase, answers in (("begin", [False]), ("pre_solve", [True]), ("post_solve", []), ("separate", [])):
        setattr(handler, phase, noting(log, phase, *answers))
    begin, separate = deciding(expected, "begin", False), noting(expected, "separate")
    plain.on_collision(BALL, FLOOR, begin=begin, separate=separate)
    assert motion(space) == motion(plain)
    assert log == expected == [("begin", BALL, FLOOR), ("separate", BALL, FLOOR)]
    assert min(body.position.y for body in space.bodies) < -100


@pytest.mark.parametrize("answers", [(True, False), (False,), (True, True, False)])
def test_pre_solve_that_returns_false_ignores_one_step(answers: tuple[bool, ...], names: None) -> None:
    space, plain = bounce(), bounce()
    log: list[Any] = []
    expected: list[Any] = []
    handler = space.add_collision_handler(FLOOR, OTHER)
    handler.pre_solve, handler.post_solve = noting(log, "pre_solve", *answers), noting(log, "post_solve")
    plain.on_collision(
        FLOOR, OTHER, pre_solve=deciding(expected, "pre_solve", *answers), post_solve=noting(expected, "post_solve")
    )
    assert motion(space) == motion(plain)
    assert log == expected
    assert sum(name == "pre_solve" for name, *_ in log) > 3
    assert all(pair == [FLOOR, OTHER] for _, *pair in log)  # the order of the handler


@pytest.mark.parametrize("kind", ["wildcard", "default"])
def test_wildcard_and_default_handlers(kind: str, names: None) -> None:
    space, plain = bounce(), bounce()
    log: list[Any] = []
    expected: list[Any] = []
    types = (OTHER, None) if kind == "wildcard" else (None, None)
    handler: Any = (
        space.add_wildcard_collision_handler(OTHER) if kind == "wildcard" else space.add_default_collision_handler()
    )
    handler.begin, handler.separate = noting(log, "begin", False), noting(log, "separate")
    plain.on_collision(*types, begin=deciding(expected, "begin", False), separate=noting(expected, "separate"))
    assert motion(space) == motion(plain)
    assert log == expected
    assert {name for name, *_ in log} == {"begin", "separate"}
    if kind == "wildcard":
        assert {first for _, first, _ in log} == {OTHER}


def test_handler_of_a_pair_answers_in_place_of_wildcards_in_the_phases_that_it_sets(names: None) -> None:
    space = bounce()
    log: list[Any] = []
    pair, wildcard = space.add_collision_handler(BALL, FLOOR), space.add_wildcard_collision_handler(BALL)
    pair.begin = noting(log, "begin of the pair", True)
    for phase in PHASES:
        setattr(wildcard, phase, noting(log, phase, True))
    space.add_default_collision_handler().pre_solve = noting(log, "default", True)
    motion(space)
    with_floor = {name for name, *types in log if types == [BALL, FLOOR]}
    assert with_floor == {"begin of the pair", "pre_solve", "post_solve", "separate"}
    with_box = {name for name, *types in log if set(types) == {BALL, OTHER}}
    assert with_box == {"begin", "default", "post_solve", "separate"}


def test_handlers_are_found_again_and_pass_their_data(names: None) -> None:
    space = bounce()
    handler = space.add_collision_handler(BALL, FLOOR)
    assert space.add_collision_handler(FLOOR, BALL) is handler
    assert space.add_wildcard_collision_handler(BALL) is space.add_wildcard_collision_handler(BALL) is not handler
    assert space.add_default_collision_handler() is space.add_default_collision_handler()
    assert isinstance(handler, pymunk.CollisionHandler)
    assert handler.begin is None
    handler.data["score"] = 0
    handler.separate = lambda arbiter, space, data: data.update(score=data["score"] + 1)
    motion(space)
    assert handler.data["score"] > 2


def test_answer_that_is_no_bool_counts_as_true_with_a_warning(names: None) -> None:
    space = bounce()
    space.add_default_collision_handler().begin = lambda arbiter, space, data: None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        states = motion(space)
    assert caught
    assert all("'<lambda>' should return a bool" in str(each.message) for each in caught)
    assert caught[0].filename == __file__
    assert states == motion(bounce())


def every_third(arbiter: pymunk.Arbiter, space: pymunk.Space, data: dict[str, int]) -> bool:
    data["calls"] = data.get("calls", 0) + 1
    return data["calls"] % 3 != 0


def ignored(arbiter: pymunk.Arbiter, space: pymunk.Space, data: dict[str, int]) -> bool:
    data["calls"] = data.get("calls", 0) + 1
    return False


@pytest.mark.parametrize("copied", [lambda space: space.copy(), lambda space: pickle.loads(pickle.dumps(space))])
def test_copies_of_a_space_have_the_handlers_and_continue_to_the_same_bits(copied: Any, names: None) -> None:
    space = bounce()
    space.add_collision_handler(BALL, FLOOR).pre_solve = every_third
    space.add_wildcard_collision_handler(OTHER).begin = ignored
    for _ in range(25):  # the box is within the floor, where its contact stays ignored
        space.step(DT)
    other = copied(space)
    assert motion(other) == motion(space)
    theirs = other.add_collision_handler(BALL, FLOOR)
    assert theirs.pre_solve is every_third
    assert theirs is not space.add_collision_handler(BALL, FLOOR)
    assert theirs.data == space.add_collision_handler(BALL, FLOOR).data
    theirs.begin = every_third
    assert "begin" not in space.add_collision_handler(BALL, FLOOR).callbacks


def test_shapes_bodies_and_joints_are_lists_and_sets_of_their_own(names: None) -> None:
    space = bounce()
    body = space.bodies[0]
    space.add(pymunk.PivotJoint(space.static_body, body, body.position))
    assert len(body.shapes | {1}) == 2
    assert body.shapes.pop() in body.shapes
    assert body.constraints.pop() is space.constraints[0]
    assert list(space.static_body.shapes) == [space.shapes[0]]
    for each in (*space.constraints, *space.shapes):
        space.remove(each)
    for each in space.bodies:
        space.remove(each)
    assert space.bodies == space.shapes == space.constraints == []


def test_queries_of_the_nearest_shape_find_no_sensors(names: None) -> None:
    space, every = bounce(), pymunk.ShapeFilter()
    sensor = pymunk.Circle(space.static_body, 30, (150, 20))
    sensor.sensor = True
    space.add(sensor)
    floor = space.shapes[0]
    for query in ((150, 20), 100, every), ((0, 100), 200, every):
        expected = min((i for i in space.point_query(*query) if i.shape is not sensor), key=lambda i: i.distance)
        assert space.point_query_nearest(*query) == expected
    hit = space.segment_query_first((150, 100), (150, -100), 1, shape_filter=every)
    assert hit is not None and hit.shape is floor
    assert space.segment_query_first((150, 30), (150, 25), 1, every) is None
    missed = floor.segment_query((0, 50), (10, 60))
    assert (missed.shape, missed.point, missed.alpha) == (None, (10, 60), 1.0)
    assert floor.segment_query((0, 50), (0, -50)).shape is floor


def test_shapes_keep_their_bodies_and_vectors_are_true(names: None) -> None:
    shape = pymunk.Circle(pymunk.Body(1, 1), 5)
    gc.collect()
    assert shape.body is not None and shape.body.mass == 1
    shape.body = pymunk.Body(3, 1)
    gc.collect()
    assert shape.body.mass == 3
    assert pymunk.Vec2d(0, 0)


def test_pymunk_is_as_before_after_the_block() -> None:
    def public() -> list[Any]:
        owners = (pymunk, pymunk.Space, pymunk.Body, pymunk.Shape, pymunk.Vec2d)
        return [dict(vars(owner)) for owner in owners]

    before, space = public(), bounce()
    with pymunk6_names():
        assert importlib.import_module("pymunk.collision_handler").CollisionHandler is pymunk.CollisionHandler
        space.add_collision_handler(BALL, FLOOR).begin = noting([], "begin", False)
        assert public() != before
    assert public() == before
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("pymunk.collision_handler")
    motion(space)
    assert min(body.position.y for body in space.bodies) < -100  # handlers stay


GAME = """
import pymunk

space = pymunk.Space()
space.gravity = (0, -900)
body = pymunk.Body(1, 10)
body.position = (0, 100)
space.add(body, pymunk.Circle(body, 5))
for k in range(9):
    space.step(1 / 60)
LINE
for k in range(20):
    space.step(1 / 60)
"""
AT = GAME.splitlines().index("LINE") + 1

REMOVED = {
    "space.add_collision_handler(1, 2)": ("Space.add_collision_handler", True),
    "space.add_wildcard_collision_handler(1)": ("Space.add_wildcard_collision_handler", True),
    "space.add_default_collision_handler()": ("Space.add_default_collision_handler", True),
    "from pymunk import CollisionHandler": ("pymunk.CollisionHandler", True),
    "import pymunk.collision_handler": ("pymunk.collision_handler", True),
    "pymunk.CollisionHandler": ("pymunk.CollisionHandler", True),
    "space.shapes[0].friction = 1": ("space.shapes", True),
    "space.bodies.copy()": ("space.bodies", True),
    "for each in space.shapes: space.remove(each)": ("space.shapes", True),
    "body.shapes.pop()": ("body.shapes", True),
    "body.constraints.copy()": ("body.constraints", True),
    "body.velocity.get_length()": ("Vec2d.get_length", False),
    "pymunk.Vec2d.rotate": ("Vec2d.rotate", False),
    "pymunk.inf": ("pymunk.inf", False),
    "import pymunk.constraint": ("pymunk.constraint", False),
    "pymunk.Vec2d((1, 2))": ("a Vec2d of one value", False),
    "body.velocity[0] = 3": ("a Vec2d", False),
    "body.velocity.length = 3": ("a Vec2d", False),
    "space.add([pymunk.Body(1, 1)])": ("a list", False),
}


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path / "game.py"


@pytest.mark.fail_slow(60)  # the first use of a replay imports and compiles
@pytest.mark.parametrize("line", REMOVED)
def test_removed_name_is_the_last_line_and_in_the_document(line: str, game: Path, capfd: Any) -> None:
    name, has_option = REMOVED[line]
    game.write_text(GAME.replace("LINE", line))
    status, document, lines = json_of(capfd, "record", "game.py")
    assert (status, document["steps"]) == (1, 9)
    assert any("Traceback" in each for each in lines)
    assert lines[-1] == document["ended"]
    assert document["ended"].startswith(f"game.py:{AT}: it ")
    assert name in document["ended"]
    assert ("--pymunk6" in document["ended"]) == has_option
    assert call(["record", "--pymunk6", "--force", "game.py"]) == (0 if has_option else 1)


def test_game_that_makes_no_step_because_of_a_removed_name(game: Path, capfd: Any) -> None:
    game.write_text("import helper\n")
    (game.parent / "helper.py").write_text("import pymunk\n\npymunk.Space().add_collision_handler(1, 2)\n")
    status, document, lines = json_of(capfd, "record", "game.py")
    assert (status, document["recording"]) == (2, None)
    assert lines[-1] == document["ended"]
    assert document["ended"].startswith("helper.py:3: it uses Space.add_collision_handler, which pymunk 7 dropped")
    assert not any("no pymunk space made a step" in each for each in lines)
    (fault,) = document["faults"]
    assert (fault["file"], fault["line"]) == ("helper.py", 3)


@pytest.mark.fail_slow(60)  # see above
@pytest.mark.parametrize("callbacks", ["begin=print", "print, print"])
def test_callbacks_as_arguments_of_the_handler_are_older(callbacks: str, game: Path, capfd: Any) -> None:
    game.write_text(GAME.replace("LINE", f"space.add_collision_handler(1, 2, {callbacks})"))
    _, document, _ = json_of(capfd, "record", "--pymunk6", "game.py")
    assert document["ended"].startswith(f"game.py:{AT}: it passes callbacks to Space.add_collision_handler")


@pytest.mark.parametrize(
    "error", [AttributeError("add_collision_handler"), RuntimeError("dictionary changed size during iteration")]
)
def test_other_errors_are_no_removed_names(error: Exception) -> None:
    class Space:
        pass

    try:
        raise error
    except type(error) as caught:
        assert removed_name(caught, "game.py") is None
    try:
        Space().add_collision_handler  # type: ignore[attr-defined]  # noqa: B018
    except AttributeError as caught:
        assert removed_name(caught, "game.py") is None


@pytest.mark.fail_slow(60)  # it is recorded and replayed
def test_game_for_pymunk_6_is_recorded_and_its_callbacks_are_remarked(game: Path, capfd: Any) -> None:
    coin = "coin = pymunk.Circle(pymunk.Body(1, 10), 4); coin.body.position = 0, 40; coin.collision_type = 7\n"
    take = "def take(arbiter, space, data):\n    space.remove(coin, coin.body)\n    return False\n"
    handler = (
        "space.add(coin, coin.body); space.add_wildcard_collision_handler(7).begin = take\nbody.velocity = 0, -300\n"
    )
    game.write_text(GAME.replace("for k in range(9)", f"{coin}{take}{handler}for k in range(9)", 1).replace("LINE", ""))
    assert call(["record", "--pymunk6", "game.py"]) == 0
    out, err = capfd.readouterr()
    assert "written: game.json (2 bodies, 29 steps" in out
    assert "1 collision callback" in err
    recording = Recording.load(Path("game.json"))
    assert sum(action.kind == "remove" for action in recording.actions) == 1
