"""Frames on engines with fixed steps: the same rules judge their shots."""

import pytest

from sandbox.games.billiards.bot import BilliardsBot
from sandbox.games.billiards.headless import play_frame
from tests.games.billiards.tables_by_hand import match


@pytest.mark.full
def test_shots_on_pymunk_are_judged_and_replay() -> None:
    played = play_frame(match("9-ball"), [BilliardsBot(0.9, 1), BilliardsBot(0.9, 2)], "pymunk", most=3)
    assert len(played.shots) == 3
    first = played.shots[0]
    assert not any("touched no ball" in foul for foul in first.fouls)
    assert played.replayed() == played
