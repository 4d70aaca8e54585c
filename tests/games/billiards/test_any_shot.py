"""Every game with random shots: no exception, valid states, and every frame ends."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.billiards.rules.base import BallEvent, Ruleset, Ruling, ShotCall, Situation
from sandbox.games.billiards.rules.registry import RULESETS
from sandbox.games.billiards.rules.snooker import SnookerState, remaining

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

POCKETS = ("left", "right")
CAROM = ("three-cushion", "straight-rail")

number = st.integers(0, 40)
event = st.tuples(st.sampled_from(("ball", "ball", "cushion", "pocket", "pocket")), number, number)
turns = st.lists(st.tuples(st.lists(event, max_size=6), number, st.booleans(), number), min_size=1, max_size=25)


def shot_of(rules: Ruleset[Any], state: Any, events: list[tuple[str, int, int]]) -> tuple[BallEvent, ...]:
    """Return events of balls on the table; half of the ball events are the cue ball hitting a ball on."""
    cue = rules.cue_ball(state)
    balls = (cue, *(ball for ball in state.table if ball != cue))
    targets = sorted(rules.legal_targets(state))
    result: list[BallEvent] = []
    for time, (kind, a, b) in enumerate(events):
        if kind == "ball":
            pair = (cue, targets[b % len(targets)]) if a % 2 else (balls[a % len(balls)], balls[b % len(balls)])
            result.append(BallEvent(time - a % 2, pair[0], "ball", pair[1]))
        elif kind == "pocket" and rules.name not in CAROM:
            result.append(BallEvent(time, balls[a % len(balls)], "pocket", POCKETS[b % 2]))
        else:
            result.append(BallEvent(time, balls[a % len(balls)], "cushion", "rail"))
    return tuple(result)


def call_of(rules: Ruleset[Any], state: Any, pick: int) -> ShotCall:
    choices = rules.choices(state)
    ball = (None, *choices.balls)[pick % (len(choices.balls) + 1)]
    pocket = (None, *POCKETS)[pick % 3] if choices.pocket else None
    return ShotCall(ball, pocket, safety=choices.safety and pick % 7 == 0, push_out=choices.push_out and pick % 2 == 0)


def assert_valid_state(rules: Ruleset[Any], state: Any) -> None:
    start = rules.start(state.players)
    assert len(state.scores) == state.players
    assert min(state.scores) >= 0
    assert 0 <= state.turn < state.players
    assert state.winner is None or (state.over and 0 <= state.winner < state.players)
    assert [ball for ball in start.table if ball in state.table] == list(state.table)
    targets = rules.legal_targets(state)
    assert targets <= set(state.table)
    assert bool(targets) != state.over
    assert state.over or state.decisions[:1] in ((), ("play",))


def assert_valid_transition(rules: Ruleset[Any], before: Any, verdict: Ruling[Any]) -> None:
    """Check the changes that one shot may make."""
    after = verdict.state
    gains = tuple(now - then for now, then in zip(after.scores, before.scores, strict=True))
    assert verdict.points == gains
    assert min(gains) >= 0
    assert set(after.table) <= set(before.table)
    assert {each.ball for each in verdict.respot} <= set(after.table)
    assert verdict.continues <= (after.turn == before.turn and not after.over)
    if isinstance(after, SnookerState) and not before.free:  # a free ball is followed by a colour, as a red is
        level = "scores level: the black is respotted" in verdict.messages
        assert level or remaining(after) <= remaining(before)


@pytest.mark.parametrize("players", [1, 2])
@pytest.mark.parametrize("name", RULESETS)
@given(turns=turns, misses=st.booleans())
def test_any_shots_give_a_valid_state(name: str, players: int, turns: list[Any], misses: bool) -> None:
    rules = RULESETS[name]
    state = rules.start(players)
    if isinstance(state, SnookerState):
        state = replace(state, misses=misses, table=state.table[10:])  # few reds, to reach the colours
    for events, pick, snookered, choice in turns:
        offered = rules.choices(state).decisions
        if offered and choice % 3:
            state = rules.decide(state, offered[choice % len(offered)]).state
            assert_valid_state(rules, state)
            if state.over:
                break
        shot, call = shot_of(rules, state, events), call_of(rules, state, pick)
        verdict = rules.judge(state, call, shot)
        assert rules.judge(state, call, shot) == verdict  # rules have no memory besides the state
        assert_valid_state(rules, verdict.state)
        assert_valid_transition(rules, state, verdict)
        state = verdict.state
        if state.over:
            break
        cue = rules.cue_ball(state)
        near = tuple(ball for ball in state.table if ball != cue)[: choice % 2]
        state = rules.settle(state, Situation(near, snookered, near)).state
        assert_valid_state(rules, state)


@pytest.mark.parametrize("players", [1, 2])
@pytest.mark.parametrize("name", RULESETS)
@given(mistakes=st.lists(st.integers(0, 2), max_size=12))
def test_frame_of_successful_shots_with_some_mistakes_ends(name: str, players: int, mistakes: list[int]) -> None:
    """Each shot pots the ball on or makes the carom, except for some that miss, scratch or hit nothing."""
    rules = RULESETS[name]
    state = rules.start(players)
    balls = 2 * len(state.table) + 110  # a colour after each red; the distances of carom
    for turn in range(len(mistakes) + balls):
        cue, target = rules.cue_ball(state), min(rules.legal_targets(state), key=len)
        touch = BallEvent(0.0, cue, "ball", target)
        lines = [touch]
        if name in CAROM:
            third = next(ball for ball in state.table if ball not in (cue, target))
            lines += [BallEvent(1.0, cue, "cushion", "rail")] * 3 + [BallEvent(2.0, cue, "ball", third)]
        else:
            lines.append(BallEvent(1.0, target, "pocket", "left"))
        if turn < len(mistakes):
            scratch = BallEvent(1.0, cue, "pocket", "left")
            lines = [[], [touch], [touch, *([] if name in CAROM else [scratch])]][mistakes[turn]]
        choices = rules.choices(state)
        call = ShotCall(target if target in choices.balls else None, "left" if choices.pocket else None)
        state = rules.judge(state, call, lines).state
        if state.over:
            break
    assert state.over
