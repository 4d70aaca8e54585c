"""Bot as a player in the window: searches on a worker thread, then animates the cue and plays the stroke."""

import math
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from sandbox.games.billiards.bot import BilliardsBot
from sandbox.games.billiards.headless import FramePlan
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision
from sandbox.games.billiards.view.prediction import CueState
from sandbox.scene.description.surface import Stroke

AIM_TIME, DRAW_TIME = 0.9, 0.45
"""s, duration of the aiming and of the draw-back animation"""
DRAW_BACK_PER_SPEED = 0.02
"""m of draw-back per m/s of cue speed"""


class BotTurn(NamedTuple):
    """Decision and shot that a search has found."""

    decision: Decision | None
    """decision before the stroke"""
    plan: FramePlan | None
    """None if the decision ends the turn or the frame"""


class BotPlayer:
    """A bot with the progress of its shot."""

    def __init__(self, skill: float = 0.7, seed: int = 0) -> None:
        self._bot = BilliardsBot(skill, seed)
        self._pool = ThreadPoolExecutor(1, "bot")
        self._future: Future[BotTurn] | None = None
        self._match: Match | None = None
        self._since = -1.0
        self._start: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def search(self, match: Match) -> BotTurn | None:
        """Return the result of the search for a match; None while it runs. The first call starts it."""
        if self._match is not match or self._future is None:
            if self._future is not None and not self._future.done():
                return None  # a search for an earlier match, which cannot be cancelled
            self._match = match
            self._future = self._pool.submit(self._find_shot, match)
        return self._future.result() if self._future.done() else None

    def _find_shot(self, match: Match) -> BotTurn:
        decision: Decision | None = None
        if match.choices.decisions and match.rules.name != "free":
            decision = self._bot.decide(match)
            outcome = match.decide(decision)
            if outcome.over or outcome.turn != match.turn:
                return BotTurn(decision, None)
            match = outcome
        return BotTurn(decision, self._bot.plan(match))

    def animate(self, cue: CueState, stroke: Stroke, elapsed: float) -> bool:
        """Move the cue towards a stroke by some real time, s; return whether the animation is complete."""
        if self._since < 0.0:
            self._since, self._start = 0.0, (cue.aim, cue.side, cue.height)
        self._since += elapsed
        progress = min(self._since / AIM_TIME, 1.0)
        progress = progress * progress * (3.0 - 2.0 * progress)
        aim, side, height = self._start
        cue.aim = aim + math.remainder(stroke.aim - aim, math.tau) * progress
        cue.tip_at(side + (stroke.side - side) * progress, height + (stroke.height - height) * progress)
        cue.speed = stroke.speed
        drawn = min(max(self._since - AIM_TIME, 0.0) / DRAW_TIME, 1.0)
        cue.back = DRAW_BACK_PER_SPEED * stroke.speed * drawn
        return self._since > AIM_TIME + 1.15 * DRAW_TIME

    def reset(self) -> None:
        """Discard the result of the search, and the animation."""
        self._match, self._since = None, -1.0

    def close(self) -> None:
        """Stop the worker thread; a running search is abandoned."""
        self._pool.shutdown(wait=False, cancel_futures=True)
