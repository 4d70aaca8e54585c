"""Nudges, the tilt, and the search for a ball."""

import numpy as np
import pytest

from sandbox.action import Action, Force, Impulse
from sandbox.games.pinball.tilt import GRAVITY, JOLT, JOLT_TIME, SAME_PUSH_TIME, TiltBob
from tests.games.pinball.pinball_by_hand import MASS, OPEN, SERVE, Table, drives, moves, table


@pytest.fixture
def played() -> Table:
    each = Table(table())
    each.play()
    return each


def given(actions: list[Action], dt: float = 0.01) -> np.ndarray:
    """The velocity that forces give to ball 0, m/s, one look a step from the first action on."""
    force, total = np.zeros(2), np.zeros(2)
    steps: dict[float, np.ndarray] = {}
    for action in actions:
        if isinstance(action, Force) and action.body == "ball 0":
            steps[action.time] = np.asarray(action.force)
    first, last = min(steps), max(steps)
    for k in range(round((last - first) / dt) + 1):
        force = steps.get(next((t for t in steps if abs(t - first - k * dt) < 1e-9), -1.0), force)
        total = total + force / MASS * dt
    assert not force.any()  # it has ended
    return total


DIRECTIONS = {"nudge": (0.0, 1.0), "nudge left": (-1.0, 0.0), "nudge right": (1.0, 0.0)}


@pytest.mark.parametrize("control", DIRECTIONS)
@pytest.mark.parametrize("strength", [1.0, 0.3])
def test_nudge_gives_a_ball_half_g_for_25_ms(played: Table, control: str, strength: float) -> None:
    actions = played.press(control, strength) + played.wait(0.1)
    expected = strength * 0.5 * GRAVITY * JOLT_TIME * np.asarray(DIRECTIONS[control])
    # Though 25 ms are two steps and a half; rounding of times near 8 s against 25 ms.
    np.testing.assert_allclose(given(actions), expected, atol=1e-12)


def test_ball_in_the_lane_or_in_a_hole_is_not_pushed() -> None:
    game = Table(table())
    game.wait(0.05)
    assert not any(isinstance(action, Force) for action in game.press("nudge"))


def test_ball_that_is_caught_while_pushed_is_pushed_no_more(played: Table) -> None:
    played.press("nudge")
    assert [a.force for a in played.look(("hole", 0.0)) if isinstance(a, Force)] == [(0.0, 0.0)]


def test_whole_nudge_warns_and_the_third_tilts(played: Table) -> None:
    for expected in (["warning"], ["warning", "warning"]):
        played.press("nudge")
        played.wait(4.0)
        assert [cue for cue in played.cues if cue in ("warning", "tilt")] == expected
    played.press("left flipper")
    played.press("nudge")
    done = played.wait(0.1)
    assert played.cues[-1] == "tilt"
    assert drives(done) == [("left bat", 0.0)]
    assert played.lines()[""] == "TILT!"


def test_light_nudges_cost_nothing(played: Table) -> None:
    for _ in range(10):
        played.press("nudge", 0.13)  # of what trips a bob without damping: .1413
        played.wait(8.0)
    assert "warning" not in played.cues


def test_strokes_of_one_push_count_once(played: Table) -> None:
    played.press("nudge")
    played.wait(SAME_PUSH_TIME)
    assert played.cues.count("warning") == 1


def tilted(played: Table) -> None:
    for _ in range(3):
        played.press("nudge left")
        played.wait(1.0)
    assert played.game.nudge.tilted


def test_tilted_table_is_dead_until_the_drain_and_counts_no_bonus(played: Table) -> None:
    played.look(("drop 1", 0.5))
    before = played.game.score
    tilted(played)
    assert drives(played.press("left flipper")) == [("left bat", 0.0)]
    assert played.press("nudge") == []
    played.look(("bumper a", 1.0), ("standup 1", 1.0), ("standup 2", 1.0))
    assert played.game.score == before
    assert "Mode" not in played.lines()
    played.look(("drain", 0.0))
    played.wait(2.9)
    assert played.lines()["Ball"] == "1 of 3"
    played.wait(0.3)
    assert (played.game.score, played.lines()["Ball"]) == (before, "2 of 3")
    assert not played.game.nudge.tilted
    assert drives(played.press("left flipper")) == [("left bat", 1.0)]


def test_tilt_saves_no_ball() -> None:
    game = Table(table())
    game.wait(0.05)
    game.put(0, OPEN)
    game.wait(0.1)
    tilted(game)
    game.look(("drain", 0.0))
    assert "save" not in game.cues


def test_bob_is_driven_as_hard_as_the_balls(played: Table) -> None:
    played.game.nudge.bob.trip = np.inf
    played.press("nudge right", 1.0)
    played.wait(0.04)
    # In looks of 10 ms, though the push is over in the middle of one; the table itself goes to the left.
    expected = TiltBob(trip=np.inf)
    expected.swing(JOLT_TIME, -JOLT)
    expected.swing(0.04 - JOLT_TIME, 0j)
    assert played.game.nudge.bob.angle == pytest.approx(expected.angle, rel=1e-9)  # times near 8 s, rounded


def test_search_pulses_every_coil_after_ten_slow_seconds(played: Table) -> None:
    played.look(("lane 1", 0.0))
    played.put(0, OPEN, (0.0, 0.0))
    assert drives(played.wait(9.9)) == []
    assert drives(played.wait(1.0)) == [("left bat", 1.0), ("left bat", 0.0), ("right bat", 1.0), ("right bat", 0.0)]
    assert played.lines()[""] == "ball search"


def test_switch_ends_a_search(played: Table) -> None:
    played.look(("lane 2", 0.0))
    played.put(0, OPEN, (0.0, 0.0))
    played.wait(10.05)
    played.look(("lane 1", 0.0))
    assert drives(played.wait(9.0)) == [("left bat", 0.0)]  # what was on goes off


def test_search_kicks_in_its_second_round_and_fetches_the_ball_in_its_third(played: Table) -> None:
    played.put(0, OPEN, (0.0, 0.0))
    kicks, fetched = [], []
    while not fetched:
        assert played.time < 60.0
        done = played.look()
        kicks += [action for action in done if isinstance(action, Impulse)]
        fetched = moves(done)
    (kick,) = kicks
    assert np.hypot(*kick.impulse) == pytest.approx(0.5 * MASS)
    assert [where for _, where in fetched][-1] == SERVE
    assert played.lines()["Ball"] == "1 of 3"


@pytest.mark.parametrize("why", ["in the lane", "flipper up", "moving"])
def test_table_does_not_search_while_it_knows_better(played: Table, why: str) -> None:
    if why == "in the lane":
        played.put(0, SERVE, (0.0, 0.0))
    elif why == "flipper up":
        played.put(0, OPEN, (0.0, 0.0))
        played.press("left flipper")
    else:
        played.put(0, OPEN, (0.0, 0.5))
    assert drives(played.wait(19.0)) == []


def test_search_is_by_the_seed_alone() -> None:
    def kick(seed: int) -> tuple[float, float]:
        scene = table()
        world = scene.world.model_copy(update={"seed": seed})
        game = Table(scene.model_copy(update={"world": world}))
        game.play()
        game.put(0, OPEN, (0.0, 0.0))
        while True:
            for action in game.look():
                if isinstance(action, Impulse):
                    return action.impulse

    assert kick(5) == kick(5)
    assert kick(5) != kick(6)


def test_tilt_is_of_a_ball_that_is_loose_and_the_plunger_is_only_a_rod() -> None:
    game = Table(table())
    game.wait(0.05)
    for _ in range(5):  # the ball waits in the lane, where a jolt wins nothing
        game.press("nudge")
        game.wait(4.0)
    assert not game.game.nudge.tilted
    game.put(0, OPEN)
    game.wait(0.1)
    tilted(game)
    game.put(0, SERVE)  # it was not shot far enough: without the plunger the game would never go on
    game.wait(0.1)
    assert drives(game.press("plunger", 0.8)) == [("plunger", 0.8)]
    assert drives(game.press("left flipper")) == [("left bat", 0.0)]
