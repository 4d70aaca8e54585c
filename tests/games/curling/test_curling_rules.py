"""A match of curling: deliveries, stones out of play, guards, ends, sweeping, bots."""

import copy
import json

import pytest

import sandbox
from sandbox.action import Move, SetParameter, actions_from_json
from sandbox.games.contract import Press, UnsuitableSceneError
from sandbox.games.curling.rules import Curling, CurlingScore
from sandbox.games.curling.sheet import RELEASE, in_free_guard_zone, is_hogged, parked_position, removed_position
from sandbox.games.players import NoInput, ScriptedInput
from sandbox.games.registry import rules_of
from sandbox.games.session import HeadlessGame
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from tests.games.curling.ice import Rink, sheet

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of tables


@pytest.fixture
def rink() -> Rink:
    rink = Rink(sheet())
    rink.until("next")
    return rink


def place_stones(rink: Rink, **stones: tuple[float, float]) -> None:
    """Place stones as if they had been delivered there."""
    for name, position in stones.items():
        name = name.replace("_", "-")
        rink.simulation.apply(Move(time=0.0, body=name, position=position))
        rink.rules._places[rink.rules._names.index(name)] = position


def test_a_stone_is_thrown_towards_the_broom_and_curls_away_from_it(rink: Rink) -> None:
    assert rink.position_of("red-1") == (RELEASE, 0.0)
    rink.throw(aside=-1.05)
    x, y = rink.position_of("red-1")
    assert abs(x) < 0.1  # the weight is for the tee
    assert abs(y) < 0.2  # and the curl about 1 m
    assert rink.position_of("yellow-1") == (RELEASE, 0.0)


def test_opposite_turns_give_mirrored_paths(rink: Rink) -> None:
    other = Rink(sheet())
    other.until("next")
    rink.throw(aside=0.5, weight=1.0)
    other.throw(aside=-0.5, weight=1.0, turn=-1)
    (x, y), (u, v) = rink.position_of("red-1"), other.position_of("red-1")
    assert (x, y) == pytest.approx((u, -v), abs=1e-9)  # rounding


def test_a_stone_short_of_the_hog_line_is_removed(rink: Rink) -> None:
    rink.throw(weight=-8.0)
    assert rink.position_of("red-1") == removed_position(0, 0)
    assert ("", "stone removed: short of the hog line") in rink.rules.display_lines()


def test_a_stone_is_removed_when_it_passes_the_back_line(rink: Rink) -> None:
    rink.throw(weight=10.0)
    assert rink.position_of("red-1") == removed_position(0, 0)


def test_a_guard_taken_out_too_early_is_replaced(rink: Rink) -> None:
    place_stones(rink, yellow_1=(-4.0, -0.55))
    rink.rules._score = CurlingScore(2, thrown=2)
    rink.rules._ready = False
    rink.until("next")
    rink.rules._broom = rink.rules._ice.through((-4.0, -0.55), 1, 3.2).heading * -RELEASE
    rink.throw(weight=14.0)
    assert rink.position_of("yellow-1") == (-4.0, -0.55)
    assert rink.position_of("red-2") == removed_position(0, 1)
    assert ("", "free guard zone: stones replaced") in rink.rules.display_lines()


def test_a_hogged_stone_that_touched_a_guard_is_protected_as_a_guard(rink: Rink) -> None:
    place_stones(rink, red_1=(-6.15, -0.02))
    rink.rules._score = CurlingScore(2, thrown=1)
    rink.rules._ready = False
    rink.until("next")
    rink.rules._broom = rink.rules._ice.through((-6.15, -0.02), 1, 0.2).heading * -RELEASE
    rink.hold("softer", 5.9 / 2.5)
    rink.step(("throw", 1.0), ("throw", 0.0))
    rink.until("next")
    x, y = rink.position_of("yellow-1")
    assert is_hogged((x, y))
    assert not in_free_guard_zone((x, y))
    place_stones(rink, red_1=(0.0, 2.0))
    rink.rules._broom = rink.rules._ice.through((x, y), 1, 3.2).heading * -RELEASE
    rink.throw(weight=14.0)
    assert rink.position_of("yellow-1") == (x, y)
    assert ("", "free guard zone: stones replaced") in rink.rules.display_lines()


def test_the_sixth_stone_may_take_out_a_guard(rink: Rink) -> None:
    place_stones(rink, red_1=(-4.0, -0.55))
    rink.rules._score = CurlingScore(2, thrown=5)
    rink.rules._ready = False
    rink.until("next")
    rink.rules._broom = rink.rules._ice.through((-4.0, -0.55), 1, 3.2).heading * -RELEASE
    rink.throw(weight=14.0)
    assert rink.position_of("red-1") == removed_position(0, 0)


def test_sweeping_makes_a_stone_travel_farther_and_straighter(rink: Rink) -> None:
    plain = Rink(sheet())
    plain.until("next")
    plain.throw(weight=-3.0)
    rink.hold("softer", 3.0 / 2.5)
    rink.step(("throw", 1.0), ("throw", 0.0))
    rink.step(("sweep", 1.0))
    rink.until("next")
    (x, y), (u, v) = rink.position_of("red-1"), plain.position_of("red-1")
    assert 2.0 < x - u < 4.5  # about 3 m for a stone that is swept along its whole path
    assert 0.0 < y < v
    scene = rink.simulation.scene
    assert scene.surface == sheet().surface  # the ice is unchanged


def test_a_finished_end_is_scored_and_the_next_begins(rink: Rink) -> None:
    place_stones(rink, yellow_1=(0.5, 0.0), yellow_2=(0.0, -0.7), red_1=(0.0, 1.2))
    rink.rules._score = CurlingScore(2, thrown=15)
    rink.rules._ready = False
    rink.until("next")
    rink.throw(weight=14.0, aside=2.2)
    assert rink.rules._score.points == (0, 2)
    assert rink.rules._score.hammer == 0
    assert rink.position_of("yellow-1") == (RELEASE, 0.0)
    assert rink.position_of("yellow-2") == parked_position(1, 1)
    assert rink.position_of("red-1") == parked_position(0, 0)


def test_only_sweeping_is_accepted_while_stones_move(rink: Rink) -> None:
    rink.step(("throw", 1.0))
    assert rink.rules.on_input("throw", 1.0) == ()
    assert [action.kind for action in rink.rules.on_input("sweep", 1.0)] == ["set", "set"]


def test_a_copy_of_the_rules_is_independent(rink: Rink) -> None:
    rules = copy.deepcopy(rink.rules)
    rink.throw()
    assert rules._score.thrown == 0
    assert rink.rules._score.thrown == 1


@pytest.mark.fail_slow(60)  # takes over half a second
def test_a_scripted_game_with_sweeping_replays_to_the_same_state() -> None:
    scene = sheet("world.duration=60.0")
    script = [Press(0.5, "right", 1.0), Press(1.5, "right", 0.0), Press(2.0, "throw", 1.0), Press(6.0, "sweep", 1.0)]
    script += [Press(14.0, "sweep", 0.0), Press(31.0, "throw", 1.0)]
    played = sandbox.run(
        scene, bout=HeadlessGame(Curling(scene, scene.bodies), ScriptedInput(script), "script"), audit=False
    )
    actions = actions_from_json(json.dumps(played.info["actions"]))
    assert sum(isinstance(action, SetParameter) for action in actions) == 4  # two parameters, set and reset
    rules = Curling(scene, scene.bodies)
    again = sandbox.run(scene, actions=actions, bout=HeadlessGame(rules, None, "script", script), audit=False)
    assert again.info["state_hash"] == played.info["state_hash"]
    assert again.info["game"]["otherwise"] is None
    assert rules._score.thrown == 2


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("duration", "thrown"),
    [(60.0, 3), pytest.param(1e4, 16, marks=pytest.mark.nightly)],
    ids=["three stones", "an end"],
)
def test_stones_of_two_bots_replay_to_the_same_score_and_state(duration: float, thrown: int) -> None:
    scene = sheet("play.curling.people=0", "play.curling.ends=1", f"world.duration={duration}")
    played = sandbox.run(scene, bout=HeadlessGame(Curling(scene, scene.bodies), NoInput(), "none"), audit=False)
    end = float(played.time[-1])
    again = sandbox.run(
        sheet("play.curling.people=0", "play.curling.ends=1", f"world.duration={end}"),
        actions=actions_from_json(json.dumps(played.info["actions"])),
        bout=HeadlessGame(Curling(scene, scene.bodies), None, "none", ()),
        audit=False,
    )
    assert again.info["state_hash"] == played.info["state_hash"]
    for key in ("score", "lines"):
        assert again.info["game"][key] == played.info["game"][key]
    assert again.info["game"]["otherwise"] is None
    assert sum(action["kind"] == "impulse" for action in played.info["actions"]) >= thrown
    assert duration < 1e4 or " wins " in played.info["game"]["over"]


def test_a_single_player_has_the_score_of_red() -> None:
    scene = load(find("games/curling"))
    rules = rules_of(scene)
    assert isinstance(rules, Curling)
    rules._score = rules._score._replace(points=(1, 4))
    assert rules.score == 1


def test_a_scene_without_stones_is_refused() -> None:
    with pytest.raises(UnsuitableSceneError, match="red-1"):
        rules_of(from_document({"play": {"game": "curling"}, "surface": {"bodies": "pucks", "sliding_friction": 0.01}}))
    with pytest.raises(UnsuitableSceneError, match="pucks"):
        rules_of(from_document({"play": {"game": "curling"}}))
