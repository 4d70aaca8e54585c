"""Frames: bots play them out; nothing is lost, nothing illegal, and they replay."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.bot import BilliardsBot
from sandbox.games.billiards.headless import FramePlan, FrameRecord, FrameTurn, play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.description.surface import Stroke
from tests.games.billiards.tables_by_hand import match, table

TERMS = {"three-cushion": {"distance": 2}, "straight-rail": {"distance": 3}, "snooker": {"misses": True}}
GAMES = ["8-ball", "9-ball", "snooker", "three-cushion", "straight-rail"]


def sound(turn: FrameTurn, now: Match) -> None:
    """Check what holds after every turn: what is on the table lies there and apart, what is down in a pocket."""
    here = now.on_table
    for name, (x, y, r) in here.items():
        assert now.layout.pocket_at((x, y)) is None, name
        (x0, y0), (x1, y1) = now.layout.area
        # Between the jaws of a pocket a ball may come to rest beyond the noses of the cushions, but not behind them.
        jaws = any((x - u) ** 2 + (y - v) ** 2 < (s + r) ** 2 for u, v, s in now.layout.pockets.values())
        assert jaws or (x0 < x < x1 and y0 < y < y1), (name, x, y)
    for name in set(now.layout.names) - set(here):
        assert now.layout.pocket_at(now.position[now.layout.number[name]]) is not None, name
    discs = list(here.values())
    for k, (x, y, r) in enumerate(discs):
        for u, v, s in discs[:k]:
            assert ((x - u) ** 2 + (y - v) ** 2) ** 0.5 >= r + s - 1e-9  # what counts as no overlap in a scene
    if now.state.in_hand is not None and not now.over:
        assert now.refusal(now.position[now.layout.number[now.cue]]) is None


def frame(name: str, skills: tuple[float, float], seed: int = 1) -> FrameRecord:
    begun = Match.begin(table(name, seed), **TERMS.get(name, {}))
    return play_frame(begun, [BilliardsBot(skill, 2 * seed + k) for k, skill in enumerate(skills)], on_turn=sound)


def test_frame_of_9_ball_ends_and_replays() -> None:
    played = frame("9-ball", (0.8, 0.6))
    assert played.match.over
    assert played.match.state.winner in (0, 1)
    assert played.match.shots == len(played.shots)
    again = played.replayed()
    assert again.match == played.match
    assert again.session == played.session


def test_session_leads_to_the_same_state_without_the_rules() -> None:
    played = frame("three-cushion", (0.9, 0.9))
    session = Recording.from_json(played.session.to_json())
    assert rerun(session, audit=False).info["state_hash"] == played.session.state_hash


def test_frame_is_cut_off_where_it_does_not_end() -> None:
    class Timid:
        def decide(self, match: Match) -> Decision:
            return "play"

        def plan(self, match: Match) -> FramePlan:
            return FramePlan(Stroke(aim=0.0, speed=0.1))

    played = play_frame(match("three-cushion"), [Timid(), Timid()], most=3)
    assert (len(played.turns), played.match.over, played.match.turn) == (3, False, 1)


def test_what_may_not_be_done_is_refused() -> None:
    class Cheat(BilliardsBot):
        def plan(self, match: Match) -> FramePlan:
            return FramePlan(Stroke(aim=0.0, speed=1.0), place=(0.6, 2.0))

    with pytest.raises(GameError, match="behind the head string"):
        play_frame(match("9-ball"), [Cheat(), Cheat()])
    with pytest.raises(GameError, match="has 2 players, not 1"):
        play_frame(match("9-ball"), [BilliardsBot()])


def test_replay_of_turns_that_do_not_fit_is_refused() -> None:
    played = frame("straight-rail", (0.9, 0.9))
    other = replace(played, turns=played.turns[1:])
    with pytest.raises(GameError, match="does not reach this"):
        replace(other, turns=(replace(other.turns[0], player=1 - played.turns[0].player), *other.turns)).replayed()


def test_free_play_takes_any_table_and_one_player() -> None:
    begun = Match.begin(table("three-cushion"), "free", players=1)
    assert begun.cue == "white"
    played = play_frame(begun, [BilliardsBot(0.9)], most=4, on_turn=sound)
    assert not played.match.over


@pytest.mark.slow
@pytest.mark.parametrize("skills", [(0.9, 0.7), (0.4, 0.1)])
@pytest.mark.parametrize("game", GAMES)
def test_frames_of_every_game_end_soundly_and_replay(game: str, skills: tuple[float, float]) -> None:
    for seed in (1,) if game == "snooker" else (1, 2):
        played = frame(game, skills, seed)
        assert played.match.over
        assert played.replayed() == played
