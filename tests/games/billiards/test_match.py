"""Match: verdicts of shots, spotted balls, undone shots."""

import numpy as np
import pytest

import sandbox
from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.placement import placement_refusal
from sandbox.games.billiards.rules.base import GameError, ShotCall
from sandbox.scene.description.surface import Stroke
from tests.games.billiards.tables_by_hand import changed_match, match, match_with_balls_at, run_until_rest, table

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

UP = 0.5 * np.pi


def table_of(now: Match) -> Table:
    return Table(now.scene).with_balls(dict(zip(now.layout.names, now.position, strict=True)))


def shot(now: Match, stroke: Stroke, call: ShotCall | None = None) -> Match:
    """Return the match after a stroke, simulated on the exact engine."""
    outcome = table_of(now).shoot(stroke, now.cue)
    assert outcome.complete
    return now.played(outcome.contacts, outcome.position, call)


def position_of(now: Match, ball: str) -> tuple[float, float]:
    return now.position[now.layout.number[ball]]


def straight_pot(**more: tuple[float, float]) -> dict[str, tuple[float, float]]:
    """Return positions with the 1 straight in front of the right middle pocket and the cue ball behind it."""
    return {"1": (1.1, 1.27), "cue": (0.8, 1.27), **more}


OPEN = {"opening": False, "in_hand": None}


def after_break(positions: dict[str, tuple[float, float]], name: str = "9-ball", **state: object) -> Match:
    return changed_match(match_with_balls_at(name, positions), **{**OPEN, **state})


def test_game_that_does_not_fit_the_table_is_refused_with_every_missing_part() -> None:
    with pytest.raises(GameError) as caught:
        match("9-ball", game="snooker")
    for part in ("no ball black", "does not use 1", "no spot yellow", "[[play.spot]]"):
        assert part in str(caught.value)
    with pytest.raises(GameError, match="carom has no pockets"):
        match("9-ball", game="three-cushion")
    with pytest.raises(GameError, match="no pockets"):
        match("three-cushion", game="9-ball")
    with pytest.raises(GameError, match="takes no distance"):
        match("9-ball", distance=3)


def test_potted_ball_scores_and_the_player_continues() -> None:
    after = shot(after_break(straight_pot()), Stroke(aim=0.0, speed=1.5))
    assert (after.state.scores, after.turn, after.shots) == ((1, 0), 0, 1)
    assert position_of(after, "1") == table("9-ball").pockets[2].position
    assert "1" not in after.on_table


def test_potted_cue_ball_is_in_hand_at_a_legal_position() -> None:
    after = shot(after_break(straight_pot()), Stroke(aim=0.0, speed=4.0, height=0.4))  # the cue ball follows the 1
    assert (after.turn, after.state.in_hand) == (1, "anywhere")
    radius = after.layout.radius[0]
    others = [disc for name, disc in after.on_table.items() if name != "cue"]
    assert placement_refusal(after.layout, "anywhere", position_of(after, "cue"), radius, others) is None
    moved = after.place(after.nearest((0.3, 0.3)))
    assert position_of(moved, "cue") == (0.3, 0.3)
    with pytest.raises(GameError, match="another ball"):
        after.place(position_of(after, "5"))
    with pytest.raises(GameError, match="not in hand"):
        after_break(straight_pot()).place((0.3, 0.3))


@pytest.mark.parametrize(("along", "fair"), [(0.0, False), (0.3, True)])
def test_ball_frozen_to_a_cushion_is_not_driven_to_that_cushion(along: float, fair: bool) -> None:
    """WPA 8.4: pressed straight into its own cushion, a ball is not driven to it; to another cushion, it is."""
    radius = match("9-ball").layout.radius[0]
    away = {str(k): (0.2 + 0.1 * k, 2.3) for k in range(2, 10)}
    now = after_break({"1": (radius, 0.9), "cue": (0.4, 0.9 - along), **away})
    aim = np.pi - np.arctan2(along, 0.4)
    speed = 0.55 if along == 0.0 else 3.0  # too slow for any ball to reach another cushion
    after = shot(now, Stroke(aim=float(aim), speed=speed))
    assert after.verdict is not None
    assert after.verdict.fouls == (() if fair else ("no rail after contact",))


@pytest.mark.parametrize(
    ("aim", "ball", "fair"),
    [
        (0.0, (0.9, 0.4), False),  # aimed straight at the ball
        (-UP, (0.5, 0.15), False),
        (UP, (0.5, 0.63), False),
        (np.pi, (1.2, 0.4), False),  # by a side cushion behind the head string
        (UP, (0.5, 0.635), True),  # a ball on the head string is not behind it
        (UP, (0.5, 0.9), True),
        (-UP, (0.5, 0.9), True),  # by the head cushion
        (UP, (0.5, 0.2), True),  # by the foot cushion
    ],
)
def test_cue_ball_in_hand_must_cross_the_head_string_to_hit_a_ball_behind_it(
    aim: float, ball: tuple[float, float], fair: bool
) -> None:
    """WPA 6.11."""
    others = {str(k): (1.0, 1.2 + 0.08 * k) for k in range(2, 16)}
    now = after_break({**others, "1": ball, "cue": (0.5, 0.4)}, "8-ball", in_hand="behind the head string")
    outcome = table_of(now).shoot(Stroke(aim=float(aim), speed=6.0), "cue")
    assert next(each.other for each in now.events(outcome.contacts) if each.kind == "ball") == "1"
    after = now.played(outcome.contacts, outcome.position)
    assert after.verdict is not None
    wrong = [foul for foul in after.verdict.fouls if "behind the head string" in foul]
    assert bool(wrong) is not fair
    if wrong:
        assert (after.turn, after.state.in_hand) == (1, "anywhere")


def test_nine_potted_on_a_foul_is_spotted_behind_the_ball_on_its_spot() -> None:
    foot = match("9-ball").layout.spots["foot"]
    away = {str(k): (0.1 + 0.1 * k, 0.3) for k in range(2, 8)}
    now = after_break({"9": (1.1, 1.27), "cue": (0.8, 1.27), "1": foot, "8": (0.1, 1.9), **away})
    after = shot(now, Stroke(aim=0.0, speed=1.5))
    assert after.state.scores == (0, 0)
    assert after.verdict is not None
    assert after.verdict.fouls == ("the 9 was hit first instead of the 1",)
    radius = after.layout.radius[0]
    # behind that ball, with the gap of 1e-5 m that spotted balls keep
    assert position_of(after, "9") == pytest.approx((foot[0], foot[1] + 2.0 * radius + 1e-5), abs=1e-12)


def test_moves_of_the_previous_match_undo_a_shot() -> None:
    before = after_break(straight_pot())
    simulation = sandbox.start(before.scene, "exact")
    for action in before.moves(simulation.frame().position):
        simulation.apply(action)
    simulation.contacts()
    start_time = simulation.time
    simulation.apply(before.strike(Stroke(aim=0.0, speed=1.5), start_time))
    contacts = run_until_rest(simulation)
    after = before.played(contacts, simulation.frame().position, None, start_time)
    assert after.moves(simulation.frame().position) == ()
    moves = before.moves(simulation.frame().position, simulation.time)
    assert {move.body for move in moves} == {"1", "cue"}
    for action in moves:
        simulation.apply(action)
    assert [tuple(each) for each in simulation.frame().position.tolist()] == list(before.position)
    # The restored ball can be potted again, with the same result.
    simulation.apply(before.strike(Stroke(aim=0.0, speed=1.5), simulation.time))
    again = before.played(run_until_rest(simulation), simulation.frame().position, None, moves[0].time)
    assert again.state == after.state


def test_miss_of_snooker_restores_every_ball() -> None:
    now = match("snooker", misses=True)
    missed = shot(now, Stroke(aim=-UP, speed=0.5))  # to the baulk cushion: no ball is hit
    assert "restore" in missed.choices.decisions
    restored = missed.decide("restore")
    assert restored.position == now.position
    assert (restored.turn, restored.state.scores) == (0, (0, 4))


def test_last_turn_of_carom_begins_with_the_cue_balls_exchanged() -> None:
    now = match("straight-rail", distance=1)
    start = {name: position_of(now, name) for name in now.layout.names}
    initial = changed_match(now, {"white": (0.5, 0.5), "yellow": (0.5, 1.0), "red": (0.56, 0.8)}, opening=False)
    shots = (shot(initial, Stroke(aim=aim, speed=2.0)) for aim in np.linspace(1.2, 1.5, 31).tolist())
    last = next(each for each in shots if each.state.scores == (1, 0))  # off the red to the yellow
    assert (last.turn, last.state.last) == (1, True)
    assert last.cue == "yellow"
    assert position_of(last, "yellow") == start["white"]
    assert position_of(last, "white") == start["yellow"]
    assert position_of(last, "red") == start["red"]


def strokes(seed: int, count: int) -> FloatArray:
    random = np.random.default_rng(seed)
    return np.column_stack((random.uniform(-np.pi, np.pi, count), random.uniform(1.0, 6.0, count)))


@pytest.mark.parametrize(
    "name",
    ["9-ball", "snooker", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("8-ball", "three-cushion"))],
)
def test_stepped_simulation_and_whole_shots_give_the_same_verdicts(name: str) -> None:
    now = match(name)
    simulation = sandbox.start(now.scene, "exact")
    simulation.contacts()
    for aim, speed in strokes(5, 6).tolist():
        stroke = Stroke(aim=UP, speed=8.0) if now.shots == 0 else Stroke(aim=aim, speed=speed)
        call = ShotCall(ball=now.choices.balls[0]) if name == "snooker" and now.choices.balls else ShotCall()
        whole = shot(now, stroke, call)
        start_time = simulation.time
        for action in (*now.moves(simulation.frame().position, start_time), now.strike(stroke, start_time)):
            simulation.apply(action)
        contacts = run_until_rest(simulation)
        stepped = now.played(contacts, simulation.frame().position, call, start_time)
        assert stepped.state == whole.state
        assert stepped.verdict == whole.verdict
        # rounding of times with another origin, 1e-14 s, which a break amplifies
        assert np.array(stepped.position) == pytest.approx(np.array(whole.position), abs=1e-6)
        if stepped.over:
            break
        now = stepped


@pytest.mark.parametrize("seed", range(2))
def test_moves_permute_balls_without_overlap(seed: int) -> None:
    now = match("9-ball")
    order = np.random.default_rng(seed).permutation(len(now.position))
    pocket = table("9-ball").pockets[0].position
    positions = [now.position[k] if k != 4 else pocket for k in order.tolist()]
    other = changed_match(now, dict(zip(now.layout.names, positions, strict=True)))
    simulation = sandbox.start(now.scene, "exact")
    for target in (other, now, other):
        for action in target.moves(simulation.frame().position):
            simulation.apply(action)  # the engine refuses a ball that overlaps another
        assert [tuple(each) for each in simulation.frame().position.tolist()] == list(target.position)
