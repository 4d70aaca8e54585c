"""What scores by itself: targets, lamps, drops, spinner, holes, ramps."""

import math

import pytest

from sandbox.action import Move
from sandbox.games.pinball.devices import DECAY, HOLD_TIME, PLATE_RADIUS
from sandbox.games.pinball.drop_targets import FALL, REST
from tests.games.pinball.pinball_by_hand import OPEN, Table, moves, table, thrown, toggles


@pytest.fixture
def played() -> Table:
    """A ball on the table, whose save has run out."""
    each = Table(table())
    each.play()
    return each


POINTS = {"bumper a": 500, "sling": 110, "standup 1": 2_000, "lane 1": 1_000, "outlane": 7_000}


@pytest.mark.parametrize("name", POINTS)
def test_hit_scores_what_the_element_states_or_its_role_is_worth(played: Table, name: str) -> None:
    played.look((name, 0.5))
    assert played.game.score == POINTS[name]
    played.look((name, 0.01))
    soft = 0 if name in ("bumper a", "sling", "standup 1") else POINTS[name]
    assert played.game.score == POINTS[name] + soft


def test_full_set_of_lanes_scores_and_counts_the_bonus_once_more(played: Table) -> None:
    for name in ("lane 1", "lane 2", "lane 2", "lane 3"):
        assert played.game.sheet.times == 1
        played.look((name, 0.5))
    assert played.game.sheet.times == 2
    assert played.game.score == 4 * 1_000 + 10_000
    assert not any(played.game.lamps[0].lit)


@pytest.mark.parametrize(("control", "lit"), [("left flipper", "lane 1"), ("right flipper", "lane 3")])
def test_flipper_moves_the_lights_of_lanes(played: Table, control: str, lit: str) -> None:
    played.look(("lane 2", 0.5))
    played.press(control)
    lamps = played.game.lamps[0]
    assert [name for name, on in zip(lamps.names, lamps.lit, strict=True) if on] == [lit]
    played.press(control)  # held already
    played.press(control, 0.0)
    assert sum(lamps.lit) == 1


def test_lights_of_targets_stay_where_they_are(played: Table) -> None:
    played.look(("standup 2", 0.5))
    played.press("left flipper")
    assert played.game.lamps[1].lit == [False, True]


def test_drop_target_falls_after_260_ms(played: Table) -> None:
    hit = played.time
    played.look(("drop 1", 0.5))
    assert played.game.score == 2_500
    while not (down := toggles(played.look())):
        assert played.time < hit + 1.0
    fell = played.time - 0.01  # the look that said so
    assert down == [("drop 1", False)]
    assert FALL - 1e-9 <= fell - hit < FALL + 0.01 + 1e-9  # the first look after it; rounding of sums of steps
    played.look(("drop 1", 0.5))
    assert played.game.score == 2_500  # it is down


def test_soft_touch_leaves_a_drop_target_standing(played: Table) -> None:
    played.look(("drop 1", 0.1))
    assert toggles(played.wait(1.0)) == []


def test_full_bank_scores_and_rises_after_a_while(played: Table) -> None:
    played.look(("drop 1", 0.5), ("drop 2", 0.5))
    done = played.wait(FALL + 0.02)
    assert toggles(done) == [("drop 1", False), ("drop 2", False)]
    assert played.game.score == 2 * 2_500 + 25_000
    assert toggles(played.wait(REST - 0.05)) == []
    assert toggles(played.wait(0.1)) == [("drop 1", True), ("drop 2", True)]
    played.look(("drop 1", 0.5))
    assert played.game.score == 3 * 2_500 + 25_000


def test_bank_never_rises_onto_a_ball(played: Table) -> None:
    played.look(("drop 1", 0.5), ("drop 2", 0.5))
    played.put(0, (0.25, 0.507), (0.0, 0.0))  # 7 mm beside the first; half its thickness and a radius are 16 mm
    assert toggles(played.wait(5.0)) == [("drop 1", False), ("drop 2", False)]
    played.put(0, (0.25, 0.52))
    assert toggles(played.look()) == [("drop 1", True), ("drop 2", True)]


def test_spinner_turns_as_often_as_its_closed_form_says(played: Table) -> None:
    speed = 1.5
    played.put(0, OPEN, (0.0, speed))
    played.look(("spinner", 0.0))
    first = played.wait(0.2)
    assert not first
    omega = speed / PLATE_RADIUS
    turned = omega / DECAY * (1.0 - math.exp(-DECAY * 0.2)) / (2.0 * math.pi)
    assert played.cues.count("spinner") == math.floor(turned)
    played.wait(10.0)
    # Until it is slower than 4 rad/s: (Ω₀ − 4)/k of angle. The look at which that is seen may be one turn late.
    whole = (omega - 4.0) / DECAY / (2.0 * math.pi)
    assert math.floor(whole) <= played.cues.count("spinner") <= math.floor(whole) + 1
    assert played.game.score == 250 * played.cues.count("spinner")


def test_hole_holds_then_throws_the_ball_out(played: Table) -> None:
    played.put(0, (0.3, 0.7), (0.0, 0.0))
    played.look(("hole", 0.0))
    assert played.game.score == 5_000
    assert not played.wait(HOLD_TIME - 0.02)
    (out,) = played.wait(0.03)
    assert isinstance(out, Move)
    assert (out.body, out.position) == ("ball 0", (0.3, 0.7))
    assert thrown(out, (0.3, -0.6))
    assert not moves(played.wait(2.0))


@pytest.mark.parametrize(
    ("shots", "made"),
    [
        (["ramp in", "ramp out"], 1),
        (["ramp in", "ramp in"], 0),
        (["ramp out"], 0),
        (["ramp in", "ramp out", "ramp out"], 1),
    ],
)
def test_ramp_is_made_by_entry_then_exit(played: Table, shots: list[str], made: int) -> None:
    for shot in shots:
        played.look((shot, 0.0))
        played.wait(0.5)
    assert played.game.score == made * 10_000


def test_ball_that_dallies_makes_no_ramp(played: Table) -> None:
    played.look(("ramp in", 0.0))
    played.wait(6.1)
    played.look(("ramp out", 0.0))
    assert played.game.score == 0
