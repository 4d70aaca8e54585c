"""Targets: whatever scores by being struck or passed, and nothing more."""

from collections.abc import Iterator

from sandbox.games.pinball.effects import Award, Cue, Effect, Light, Machine, Now, points_of
from sandbox.games.pinball.switches import Hit

ROLES = ("bumper", "slingshot", "standup", "rollover", "gate")

BONUS = {"standup": 100, "rollover": 100}
"""points of the bonus, each time"""

FLASH = 0.15
"""s, that a lamp flashes after a hit"""


class Targets(Machine):
    """Bumpers, slingshots, standing targets, rollovers and gates: each hit scores at once, and is seen as a flash."""

    def __init__(self) -> None:
        self.struck: dict[str, float] = {}
        """what was hit → when last, s"""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Score a hit."""
        role = hit.element.role
        if role not in ROLES:
            return
        self.struck[hit.element.name] = hit.time
        if role != "gate":
            yield Cue(role)
        yield Award(role, points_of(hit), hit.element.group, BONUS.get(role, 0), hit.ball)

    def lights(self, now: Now) -> Iterator[Light]:
        """Flash what was hit a moment ago."""
        return (Light(name) for name, when in self.struck.items() if 0.0 <= now.time - when < FLASH)
