"""Frames played by bots: they end, every turn leaves a valid table, and they replay."""

from collections.abc import Sequence

import pytest

from sandbox.games.billiards.bot import BilliardsBot
from sandbox.games.billiards.headless import FramePlan, FrameRecord, FrameTurn, play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError
from sandbox.scene.description.surface import Stroke
from tests.games.billiards.tables_by_hand import match, table

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

TERMS = {"three-cushion": {"distance": 2}, "straight-rail": {"distance": 3}, "snooker": {"misses": True}}


def assert_valid_table(turn: FrameTurn, now: Match) -> None:
    """Check that balls in play are on the table and do not overlap, and that potted balls are in a pocket."""
    on_table = now.on_table
    for name, (x, y, r) in on_table.items():
        assert now.layout.pocket_at((x, y)) is None, name
        (x0, y0), (x1, y1) = now.layout.area
        # Between the jaws of a pocket a ball may rest beyond the line of the noses, but not behind the cushions.
        jaws = any((x - u) ** 2 + (y - v) ** 2 < (s + r) ** 2 for u, v, s in now.layout.pockets.values())
        assert jaws or (x0 < x < x1 and y0 < y < y1), (name, x, y)
    for name in set(now.layout.names) - set(on_table):
        assert now.layout.pocket_at(now.position[now.layout.number[name]]) is not None, name
    discs = list(on_table.values())
    for k, (x, y, r) in enumerate(discs):
        for u, v, s in discs[:k]:
            assert ((x - u) ** 2 + (y - v) ** 2) ** 0.5 >= r + s - 1e-9  # tolerance of overlaps in a scene
    if now.state.in_hand is not None and not now.over:
        assert now.refusal(now.position[now.layout.number[now.cue]]) is None


def initial_match(name: str, seed: int = 1) -> Match:
    return Match.begin(table(name, seed), **TERMS.get(name, {}))


def play_frame_of(name: str, skills: tuple[float, float], seed: int = 1) -> FrameRecord:
    bots = [BilliardsBot(skill, 2 * seed + k) for k, skill in enumerate(skills)]
    return play_frame(initial_match(name, seed), bots, on_turn=assert_valid_table)


class FrameScript:
    """Player that repeats recorded turns."""

    def __init__(self, turns: Sequence[FrameTurn]) -> None:
        self._turns = iter(turns)

    def decide(self, now: Match) -> Decision:
        turn = next(self._turns)
        assert turn.player == now.turn
        assert turn.decision is not None
        return turn.decision

    def plan(self, now: Match) -> FramePlan:
        turn = next(self._turns)
        assert turn.player == now.turn
        assert turn.plan is not None
        return turn.plan


def replay(initial: Match, record: FrameRecord) -> FrameRecord:
    """Return the frame that the same turns lead to in a new simulation."""
    script = FrameScript(record.turns)
    return play_frame(initial, (script, script), record.session.engine, most=len(record.turns))


def test_frame_of_9_ball_ends_and_replays() -> None:
    record = play_frame_of("9-ball", (0.8, 0.6))
    assert record.match.over
    assert record.match.state.winner in (0, 1)
    assert record.match.shots == len(record.shots)
    again = replay(initial_match("9-ball"), record)
    assert again.match == record.match
    assert again.session == record.session


def test_frame_is_cut_off_at_the_maximum_number_of_turns() -> None:
    class WeakPlayer:
        def decide(self, match: Match) -> Decision:
            return "play"

        def plan(self, match: Match) -> FramePlan:
            return FramePlan(Stroke(aim=0.0, speed=0.1))

    record = play_frame(match("three-cushion"), [WeakPlayer(), WeakPlayer()], most=3)
    assert (len(record.turns), record.match.over, record.match.turn) == (3, False, 1)


def test_illegal_placement_and_missing_player_are_refused() -> None:
    class IllegalPlacement(BilliardsBot):
        def plan(self, match: Match) -> FramePlan:
            return FramePlan(Stroke(aim=0.0, speed=1.0), place=(0.6, 2.0))

    with pytest.raises(GameError, match="behind the head string"):
        play_frame(match("9-ball"), [IllegalPlacement(), IllegalPlacement()])
    with pytest.raises(GameError, match="has 2 players, not 1"):
        play_frame(match("9-ball"), [BilliardsBot()])


@pytest.mark.nightly
@pytest.mark.parametrize("skills", [(0.9, 0.7), (0.4, 0.1)])
@pytest.mark.parametrize("game", ["8-ball", "9-ball", "straight-rail", "three-cushion"])
def test_frames_of_every_game_end_with_a_valid_table_and_replay(game: str, skills: tuple[float, float]) -> None:
    record = play_frame_of(game, skills)
    assert record.match.over
    assert replay(initial_match(game), record) == record


@pytest.mark.fail_slow(60)  # takes over half a second
def test_shots_on_pymunk_are_judged_and_replay() -> None:
    played = play_frame(match("9-ball"), [BilliardsBot(0.9, 1), BilliardsBot(0.9, 2)], "pymunk", most=3)
    assert len(played.shots) == 3
    first = played.shots[0]
    assert not any("touched no ball" in foul for foul in first.fouls)
    assert replay(match("9-ball"), played) == played


@pytest.mark.nightly
def test_frame_of_snooker_ends_with_a_valid_table() -> None:
    assert play_frame_of("snooker", (0.9, 0.7)).match.over
