"""Nudges, tilt and ball search."""

import numpy as np
import pytest

from sandbox.action import Action, Force, Impulse
from sandbox.games.pinball.tilt import GRAVITY, JOLT_ACCELERATION, JOLT_TIME, SAME_PUSH_TIME, TiltBob
from tests.games.pinball.pinball_by_hand import MASS, OPEN, SERVE, Table, drives, moves, table

pytestmark = pytest.mark.fail_slow(60)  # whole games


@pytest.fixture
def game() -> Table:
    game = Table(table())
    game.play()
    return game


def velocity_change(actions: list[Action], dt: float = 0.01) -> np.ndarray:
    """Return the velocity that forces give to ball 0, m/s, with a sample per step from the first action on."""
    force, total = np.zeros(2), np.zeros(2)
    steps: dict[float, np.ndarray] = {}
    for action in actions:
        if isinstance(action, Force) and action.body == "ball 0":
            steps[action.time] = np.asarray(action.force)
    first, last = min(steps), max(steps)
    for k in range(round((last - first) / dt) + 1):
        force = steps.get(next((t for t in steps if abs(t - first - k * dt) < 1e-9), -1.0), force)
        total = total + force / MASS * dt
    assert not force.any()  # the push has ended
    return total


DIRECTIONS = {"nudge": (0.0, 1.0), "nudge left": (-1.0, 0.0), "nudge right": (1.0, 0.0)}


@pytest.mark.parametrize("control", DIRECTIONS)
@pytest.mark.parametrize("strength", [1.0, 0.3])
def test_nudge_accelerates_a_ball_by_half_g_for_25_ms(game: Table, control: str, strength: float) -> None:
    actions = game.press(control, strength) + game.wait(0.1)
    expected = strength * 0.5 * GRAVITY * JOLT_TIME * np.asarray(DIRECTIONS[control])
    # 25 ms are 2.5 steps; the tolerance is the rounding of times near 8 s against 25 ms.
    np.testing.assert_allclose(velocity_change(actions), expected, atol=1e-12)


def test_ball_in_the_lane_is_not_pushed() -> None:
    game = Table(table())
    game.wait(0.05)
    assert not any(isinstance(action, Force) for action in game.press("nudge"))


def test_push_ends_when_a_hole_captures_the_ball(game: Table) -> None:
    game.press("nudge")
    assert [a.force for a in game.advance(("hole", 0.0)) if isinstance(a, Force)] == [(0.0, 0.0)]


def test_full_nudge_warns_and_the_third_tilts(game: Table) -> None:
    for expected in (["warning"], ["warning", "warning"]):
        game.press("nudge")
        game.wait(4.0)
        assert [cue for cue in game.cues if cue in ("warning", "tilt")] == expected
    game.press("left flipper")
    game.press("nudge")
    actions = game.wait(0.1)
    assert game.cues[-1] == "tilt"
    assert drives(actions) == [("left bat", 0.0)]
    assert game.lines()[""] == "TILT!"


def test_light_nudges_do_not_warn(game: Table) -> None:
    for _ in range(10):
        game.press("nudge", 0.13)  # an undamped bob trips at 0.1413
        game.wait(8.0)
    assert "warning" not in game.cues


def test_repeated_strokes_of_one_push_count_once(game: Table) -> None:
    game.press("nudge")
    game.wait(SAME_PUSH_TIME)
    assert game.cues.count("warning") == 1


def tilt_table(game: Table) -> None:
    for _ in range(3):
        game.press("nudge left")
        game.wait(1.0)
    assert game.game.nudge.tilted


def test_tilted_table_is_dead_until_the_drain_and_pays_no_bonus(game: Table) -> None:
    game.advance(("drop 1", 0.5))
    before = game.game.score
    tilt_table(game)
    assert drives(game.press("left flipper")) == [("left bat", 0.0)]
    assert game.press("nudge") == []
    game.advance(("bumper a", 1.0), ("standup 1", 1.0), ("standup 2", 1.0))
    assert game.game.score == before
    assert "Mode" not in game.lines()
    game.advance(("drain", 0.0))
    game.wait(2.9)
    assert game.lines()["Ball"] == "1 of 3"
    game.wait(0.3)
    assert (game.game.score, game.lines()["Ball"]) == (before, "2 of 3")
    assert not game.game.nudge.tilted
    assert drives(game.press("left flipper")) == [("left bat", 1.0)]


def test_tilt_disables_the_ball_save() -> None:
    game = Table(table())
    game.wait(0.05)
    game.put(0, OPEN)
    game.wait(0.1)
    tilt_table(game)
    game.advance(("drain", 0.0))
    assert "save" not in game.cues


def test_bob_has_the_acceleration_of_the_balls(game: Table) -> None:
    game.game.nudge.bob.trip = np.inf
    game.press("nudge right", 1.0)
    game.wait(0.04)
    # In steps of 10 ms, though the push ends within one; a nudge to the right pushes the bob to the left.
    expected = TiltBob(trip=np.inf)
    expected.swing(JOLT_TIME, -JOLT_ACCELERATION)
    expected.swing(0.04 - JOLT_TIME, 0j)
    assert game.game.nudge.bob.angle == pytest.approx(expected.angle, rel=1e-9)  # rounding of times near 8 s


def test_search_pulses_every_coil_after_ten_slow_seconds(game: Table) -> None:
    game.advance(("lane 1", 0.0))
    game.put(0, OPEN, (0.0, 0.0))
    assert drives(game.wait(9.9)) == []
    assert drives(game.wait(1.0)) == [("left bat", 1.0), ("left bat", 0.0), ("right bat", 1.0), ("right bat", 0.0)]
    assert game.lines()[""] == "ball search"


def test_switch_ends_a_ball_search(game: Table) -> None:
    game.advance(("lane 2", 0.0))
    game.put(0, OPEN, (0.0, 0.0))
    game.wait(10.05)
    game.advance(("lane 1", 0.0))
    assert drives(game.wait(9.0)) == [("left bat", 0.0)]  # an active coil is released


def test_search_kicks_in_its_second_round_and_returns_the_ball_in_its_third(game: Table) -> None:
    game.put(0, OPEN, (0.0, 0.0))
    kicks, returns = [], []
    while not returns:
        assert game.time < 60.0
        actions = game.advance()
        kicks += [action for action in actions if isinstance(action, Impulse)]
        returns = moves(actions)
    (kick,) = kicks
    assert np.hypot(*kick.impulse) == pytest.approx(0.5 * MASS)
    assert [position for _, position in returns][-1] == SERVE
    assert game.lines()["Ball"] == "1 of 3"


@pytest.mark.parametrize("state", ["in the lane", "flipper up", "moving"])
def test_no_search_while_a_ball_waits_is_held_or_moves(game: Table, state: str) -> None:
    if state == "in the lane":
        game.put(0, SERVE, (0.0, 0.0))
    elif state == "flipper up":
        game.put(0, OPEN, (0.0, 0.0))
        game.press("left flipper")
    else:
        game.put(0, OPEN, (0.0, 0.5))
    assert drives(game.wait(19.0)) == []


def test_search_depends_only_on_the_seed() -> None:
    def kick(seed: int) -> tuple[float, float]:
        scene = table()
        world = scene.world.model_copy(update={"seed": seed})
        game = Table(scene.model_copy(update={"world": world}))
        game.play()
        game.put(0, OPEN, (0.0, 0.0))
        while True:
            for action in game.advance():
                if isinstance(action, Impulse):
                    return action.impulse

    assert kick(5) == kick(5)
    assert kick(5) != kick(6)


def test_tilt_needs_a_ball_in_play_and_keeps_the_plunger_working() -> None:
    game = Table(table())
    game.wait(0.05)
    for _ in range(5):  # the ball waits in the lane, where a nudge has no use
        game.press("nudge")
        game.wait(4.0)
    assert not game.game.nudge.tilted
    game.put(0, OPEN)
    game.wait(0.1)
    tilt_table(game)
    game.put(0, SERVE)  # the ball fell back into the lane: without the plunger the game would not continue
    game.wait(0.1)
    assert drives(game.press("plunger", 0.8)) == [("plunger", 0.8)]
    assert drives(game.press("left flipper")) == [("left bat", 0.0)]
