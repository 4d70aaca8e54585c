"""A stroke of snooker: what was on, what it scored, and what was foul."""

from dataclasses import dataclass

from sandbox.games.billiards.rules.happening import Shot, named_first
from sandbox.games.billiards.rules.snooker_balls import COLOURS, LEAST, VALUES, colours, reds, value


@dataclass(frozen=True)
class Stroke:
    """A shot, with what was on."""

    shot: Shot
    on: frozenset[str]
    """the balls on, without a free ball; none where no colour was nominated"""
    worth: int
    """points of a ball on"""
    free: str | None
    """the ball that stands for a ball on"""
    touching: tuple[str, ...]
    """what lay against the cue ball before"""

    @property
    def fair(self) -> frozenset[str]:
        """What may fall: the balls on, and the free ball."""
        return self.on if self.free is None else self.on | {self.free}

    @property
    def hit(self) -> bool:
        """Whether the first touch was right.

        Away from a ball on that touches the cue ball it counts as played (Touching Ball). A free ball is to be touched
        first, or at one time with a ball on (Snookered after a Foul).
        """
        if self.free is None and not self.on.isdisjoint(self.touching):
            return True
        first = frozenset(self.shot.first)
        return bool(first) and first <= self.fair and (self.free is None or self.free in first)

    def value(self, ball: str) -> int:
        """Return the points of a ball, a free one being worth what it stands for."""
        return self.worth if ball == self.free else value(ball)

    @property
    def fouls(self) -> tuple[tuple[int, str], ...]:
        """What was foul, each with its points (Penalties): those of a ball on or concerned, and 4 at least."""
        shot, least = self.shot, max(LEAST, self.worth)
        found: list[tuple[int, str]] = []
        if shot.scratched:
            found.append((least, "in-off"))
        if not self.hit:
            if not shot.first:
                found.append((least, "the cue ball hit no ball"))
            else:
                most = max(least, *(self.value(ball) for ball in shot.first))
                found.append((most, f"{named_first(shot)} hit first"))
        found += [
            (max(least, self.value(ball)), f"the {ball} was potted but not on")
            for ball in shot.down
            if ball not in self.fair
        ]
        if found and not self.on:  # Penalties: a foul after a red before a colour was nominated
            found = [(VALUES["black"], why) for _, why in found]
        return tuple(found)

    @property
    def points(self) -> int:
        """What a fair stroke scores: each red, but of a free ball and the colour on only one."""
        made = [ball for ball in self.shot.down if ball in self.fair]
        if not made:
            return 0
        return len(made) if self.worth == 1 else self.worth


def stroke(
    shot: Shot, on: str, table: tuple[str, ...], named: str | None, free: bool, touching: tuple[str, ...]
) -> Stroke:
    """Return a stroke.

    Args:
        shot: what happened.
        on: `red`, `colour`, or the name of the colour on.
        table: the balls that were on the table.
        named: the colour that was nominated, or the free ball. A colour that is hit first, or from which the cue
            ball is played away, is nominated by that.
        free: whether a free ball might be nominated.
        touching: what lay against the cue ball before.
    """
    if on == "red":
        return Stroke(shot, frozenset(reds(table)), 1, named if free else None, touching)
    if on != "colour":
        return Stroke(shot, frozenset((on,)), value(on), named if free else None, touching)
    plain = colours(shot.first) if len(shot.first) == 1 else ()
    meant = (named,) if named is not None else plain or colours(touching)
    if len(meant) != 1 or meant[0] not in COLOURS:
        return Stroke(shot, frozenset(), 1, None, touching)
    return Stroke(shot, frozenset(meant), value(meant[0]), None, touching)
