"""Scoring elements: targets, lamps, drop targets, spinner, holes, ramps."""

import math

import pytest

from sandbox.action import Move
from sandbox.games.pinball.devices import HOLD_TIME, PLATE_RADIUS, SPIN_DECAY
from sandbox.games.pinball.drop_targets import FALL_TIME, REST_TIME
from tests.games.pinball.pinball_by_hand import OPEN, Table, is_launch, moves, table, toggles


@pytest.fixture
def game() -> Table:
    """A game with a ball in play after its ball save."""
    game = Table(table())
    game.play()
    return game


POINTS = {"bumper a": 500, "sling": 110, "standup 1": 2_000, "lane 1": 1_000, "outlane": 7_000}


@pytest.mark.parametrize("name", POINTS)
def test_hit_scores_the_points_of_the_element_or_of_its_role(game: Table, name: str) -> None:
    game.advance((name, 0.5))
    assert game.game.score == POINTS[name]
    game.advance((name, 0.01))
    soft_points = 0 if name in ("bumper a", "sling", "standup 1") else POINTS[name]
    assert game.game.score == POINTS[name] + soft_points


def test_full_set_of_lanes_scores_and_increases_the_bonus_multiplier(game: Table) -> None:
    for name in ("lane 1", "lane 2", "lane 2", "lane 3"):
        assert game.game.sheet.bonus_multiplier == 1
        game.advance((name, 0.5))
    assert game.game.sheet.bonus_multiplier == 2
    assert game.game.score == 4 * 1_000 + 10_000
    assert not any(game.game.lamps[0].lit)


@pytest.mark.parametrize(("control", "lit"), [("left flipper", "lane 1"), ("right flipper", "lane 3")])
def test_flipper_moves_the_lit_lane(game: Table, control: str, lit: str) -> None:
    game.advance(("lane 2", 0.5))
    game.press(control)
    lamps = game.game.lamps[0]
    assert [name for name, on in zip(lamps.names, lamps.lit, strict=True) if on] == [lit]
    game.press(control)  # already pressed
    game.press(control, 0.0)
    assert sum(lamps.lit) == 1


def test_flipper_does_not_move_lit_targets(game: Table) -> None:
    game.advance(("standup 2", 0.5))
    game.press("left flipper")
    assert game.game.lamps[1].lit == [False, True]


def test_drop_target_falls_after_260_ms(game: Table) -> None:
    hit = game.time
    game.advance(("drop 1", 0.5))
    assert game.game.score == 2_500
    while not (down := toggles(game.advance())):
        assert game.time < hit + 1.0
    fall_time = game.time - 0.01  # the step that reported it
    assert down == [("drop 1", False)]
    # the first step after that time; rounding of sums of steps
    assert FALL_TIME - 1e-9 <= fall_time - hit < FALL_TIME + 0.01 + 1e-9
    game.advance(("drop 1", 0.5))
    assert game.game.score == 2_500  # the target is down


def test_soft_touch_leaves_a_drop_target_standing(game: Table) -> None:
    game.advance(("drop 1", 0.1))
    assert toggles(game.wait(1.0)) == []


def test_full_bank_scores_and_rises_after_its_rest_time(game: Table) -> None:
    game.advance(("drop 1", 0.5), ("drop 2", 0.5))
    actions = game.wait(FALL_TIME + 0.02)
    assert toggles(actions) == [("drop 1", False), ("drop 2", False)]
    assert game.game.score == 2 * 2_500 + 25_000
    assert toggles(game.wait(REST_TIME - 0.05)) == []
    assert toggles(game.wait(0.1)) == [("drop 1", True), ("drop 2", True)]
    game.advance(("drop 1", 0.5))
    assert game.game.score == 3 * 2_500 + 25_000


def test_bank_never_rises_onto_a_ball(game: Table) -> None:
    game.advance(("drop 1", 0.5), ("drop 2", 0.5))
    game.put(0, (0.25, 0.507), (0.0, 0.0))  # 7 mm beside the first; half its thickness and a radius are 16 mm
    assert toggles(game.wait(5.0)) == [("drop 1", False), ("drop 2", False)]
    game.put(0, (0.25, 0.52))
    assert toggles(game.advance()) == [("drop 1", True), ("drop 2", True)]


def test_number_of_spinner_turns_is_the_closed_form(game: Table) -> None:
    speed = 1.5
    game.put(0, OPEN, (0.0, speed))
    game.advance(("spinner", 0.0))
    first = game.wait(0.2)
    assert not first
    omega = speed / PLATE_RADIUS
    turned = omega / SPIN_DECAY * (1.0 - math.exp(-SPIN_DECAY * 0.2)) / (2.0 * math.pi)
    assert game.cues.count("spinner") == math.floor(turned)
    game.wait(10.0)
    # It turns until it is slower than 4 rad/s: an angle of (Ω₀ − 4)/k. The step that detects this may be one turn late.
    whole = (omega - 4.0) / SPIN_DECAY / (2.0 * math.pi)
    assert math.floor(whole) <= game.cues.count("spinner") <= math.floor(whole) + 1
    assert game.game.score == 250 * game.cues.count("spinner")


def test_hole_holds_the_ball_then_ejects_it(game: Table) -> None:
    game.put(0, (0.3, 0.7), (0.0, 0.0))
    game.advance(("hole", 0.0))
    assert game.game.score == 5_000
    assert not game.wait(HOLD_TIME - 0.02)
    (out,) = game.wait(0.03)
    assert isinstance(out, Move)
    assert (out.body, out.position) == ("ball 0", (0.3, 0.7))
    assert is_launch(out, (0.3, -0.6))
    assert not moves(game.wait(2.0))


@pytest.mark.parametrize(
    ("shots", "made"),
    [
        (["ramp in", "ramp out"], 1),
        (["ramp in", "ramp in"], 0),
        (["ramp out"], 0),
        (["ramp in", "ramp out", "ramp out"], 1),
    ],
)
def test_ramp_scores_for_entry_then_exit(game: Table, shots: list[str], made: int) -> None:
    for shot in shots:
        game.advance((shot, 0.0))
        game.wait(0.5)
    assert game.game.score == made * 10_000


def test_slow_ball_does_not_score_the_ramp(game: Table) -> None:
    game.advance(("ramp in", 0.0))
    game.wait(6.1)
    game.advance(("ramp out", 0.0))
    assert game.game.score == 0
