"""What 8-ball and 9-ball share: standard fouls (WPA 6), and the break."""

from sandbox.games.billiards.rules.happening import Shot, named_first
from sandbox.games.billiards.rules.verdict import Respot

DRIVEN = 4
"""object balls that a break must drive to a cushion, if none falls (WPA 2.3, 3.3)"""


def scratch(shot: Shot) -> list[str]:
    """Return the foul of a cue ball that fell (WPA 6.1)."""
    return ["scratch"] if shot.scratched else []


def wrong_ball(shot: Shot, targets: frozenset[str]) -> list[str]:
    """Return the foul of what was touched first (WPA 6.2); of two at one time, one that is right will do."""
    if not shot.first:
        return ["the cue ball hit no ball"]
    if targets.isdisjoint(shot.first):
        return [f"{named_first(shot)} hit first instead of {_of(targets)}"]
    return []


def no_rail(shot: Shot) -> list[str]:
    """Return the foul of a touch after which no ball fell or came to a cushion (WPA 6.3)."""
    return ["no rail after contact"] if shot.first and not shot.driven else []


def from_behind(shot: Shot) -> list[str]:
    """Return the foul of a cue ball in hand that was played at a ball behind the head string (WPA 6.11)."""
    if not shot.stayed_behind:
        return []
    return [f"{named_first(shot)} behind the head string, and the cue ball had not crossed it"]


def standard(shot: Shot, targets: frozenset[str]) -> tuple[str, ...]:
    """Return the standard fouls of a shot."""
    return (*scratch(shot), *wrong_ball(shot, targets), *from_behind(shot), *no_rail(shot))


def broke(shot: Shot) -> bool:
    """Tell whether a break was strong enough."""
    return bool(shot.down) or len(shot.driven - {shot.cue}) >= DRIVEN


def at_foot(ball: str) -> Respot:
    """Return a ball to be spotted on the long string, from the foot spot on (WPA 1.4)."""
    return Respot(ball, ("foot",))


def _of(targets: frozenset[str]) -> str:
    named = sorted(targets, key=lambda ball: (len(ball), ball))
    return f"the {named[0]}" if len(named) == 1 else f"one of {', '.join(named)}"
