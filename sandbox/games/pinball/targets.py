"""Targets: whatever scores by being struck or passed, and nothing more."""

from collections.abc import Iterator

from sandbox.games.pinball.effects import Award, Cue, Effect, Machine, Now, points_of
from sandbox.games.pinball.switches import Hit

ROLES = ("bumper", "slingshot", "standup", "rollover", "gate")

BONUS = {"standup": 100, "rollover": 100}
"""points of the bonus, each time"""


class Targets(Machine):
    """Bumpers, slingshots, standing targets, rollovers and gates: each hit scores at once."""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Score a hit."""
        role = hit.element.role
        if role not in ROLES:
            return
        if role != "gate":
            yield Cue(role)
        yield Award(role, points_of(hit), hit.element.group, BONUS.get(role, 0), hit.ball)
