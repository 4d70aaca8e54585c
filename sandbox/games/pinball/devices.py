"""Lamps: sets of lights, each lit by its own switch; a set that is full scores and goes dark.

Coil: how evenly a solenoid throws a ball.

Holes: kickers that hold a ball for a moment and throw it out again.

Ramps: made by a ball that comes in at the foot and leaves at the end.

Spinner: a hanging plate that a ball sets turning as it passes; each turn counts.

Targets: whatever scores by being struck or passed, and nothing more.
"""

import math
from collections.abc import Iterator

from sandbox.action import Move
from sandbox.games.pinball.events import (
    MAX_BONUS_MULTIPLIER,
    POINTS,
    Award,
    Device,
    Effect,
    ExtraBall,
    Hit,
    Light,
    PlaySound,
    ShowMessage,
    StepContext,
    points_of,
)
from sandbox.games.pinball.playfield import Playfield, PlayfieldElement
from sandbox.scene.description.base import Vector
from sandbox.scene.description.play import Role
from sandbox.scene.random_streams import Stream, draws

WEAKEST = 0.95
"""of its whole speed: no coil throws alike each time, and a ball that flew alike each time might fly in a ring"""


class CoilVariation:
    """Throws a little more weakly than it could, by chances of its own."""

    def __init__(self, seed: int, stream: int) -> None:
        """Wind it.

        Args:
            seed: of the scene.
            stream: sets this coil's chances apart from those of others.
        """
        self._chance = draws(Stream.COIL, seed, stream)

    def throw(self, velocity: Vector) -> Vector:
        """Return a velocity, m/s, that is at most the one that is stated."""
        fraction = float(self._chance.uniform(WEAKEST, 1.0))
        return velocity[0] * fraction, velocity[1] * fraction


HOLD_TIME = 0.8
"""s"""


class Kickers(Device):
    """All the holes of a table, and which balls are in them."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.coil = CoilVariation(board.seed, 1)
        self.held: dict[int, tuple[PlayfieldElement, float]] = {}
        """ball → its hole, and when it is thrown out, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Hold a ball."""
        if hit.element.role != "kicker" or hit.ball in self.held:
            return
        self.held[hit.ball] = (hit.element, hit.time + HOLD_TIME)
        yield PlaySound("kicker")
        yield Award("kicker", points_of(hit), hit.element.group, 500, hit.ball)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Throw out what has been held long enough."""
        for ball in sorted(ball for ball, (_, when) in self.held.items() if when <= now.time):
            yield from self.thrown(ball, now)

    def thrown(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Throw out a ball from where it is held."""
        hole, _ = self.held.pop(ball)
        x, y = now.frame.position[ball].tolist()
        yield PlaySound("eject")
        yield Move(time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(hole.out))

    def forget(self, ball: int) -> None:
        """Hold a ball no more: it was taken elsewhere."""
        self.held.pop(ball, None)


BANK_AWARD: dict[Role, int] = {"rollover": 10_000, "standup": 20_000}
"""points of a set"""

BANK_LABELS: dict[Role, str] = {"rollover": "lanes", "standup": "standups"}
"""what a full set is called"""

BANK_BONUS = 2_000

EXTRA_BALL_MULTIPLIER = 4
"""times that the bonus counts, with which an extra ball comes"""

MIN_BANK_SIZE: dict[Role, int] = {"rollover": 3, "standup": 2}
"""of a set: a pair of rollovers is of inlanes or outlanes, which have no lamps"""


class LaneLights(Device):
    """The lights of one group of rollovers or standing targets.

    A full set of lanes counts the bonus once more. Before a ball rolls over a lane, the flippers move the lights: the
    left one to the left, the right one to the right, around the ends.
    """

    def __init__(self, group: str, members: tuple[PlayfieldElement, ...]) -> None:
        self.group = group
        self.role = members[0].role
        self.names = tuple(each.name for each in members)
        self.lit = [False] * len(members)

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Light what was hit."""
        if hit.element.name not in self.names:
            return
        place = self.names.index(hit.element.name)
        if self.lit[place]:
            return
        self.lit[place] = True
        yield PlaySound("lit")
        if not all(self.lit):
            return
        self.lit = [False] * len(self.lit)
        if self.role == "rollover" and now.sheet.times < MAX_BONUS_MULTIPLIER:
            now.sheet.times += 1
            yield ShowMessage(f"bonus × {now.sheet.times}")
            if now.sheet.times == EXTRA_BALL_MULTIPLIER:
                yield ExtraBall("lanes")
        yield PlaySound("set")
        yield Award(BANK_LABELS[self.role], BANK_AWARD[self.role], self.group, BANK_BONUS, hit.ball)

    def rotate(self, side: str) -> None:
        """Move the lights of lanes by one, to the side of the flipper that was raised."""
        if self.role == "rollover":
            by = 1 if side == "left" else -1
            self.lit = self.lit[by:] + self.lit[:by]

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Darken everything."""
        self.lit = [False] * len(self.lit)
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Show what was hit."""
        return (Light(name) for name, on in zip(self.names, self.lit, strict=True) if on)


def lane_lights_of(board: Playfield) -> tuple[LaneLights, ...]:
    """Return the sets of a table; what stands alone has no lamp."""
    return tuple(
        LaneLights(name, members)
        for role, least in MIN_BANK_SIZE.items()
        for name, members in board.groups(role).items()
        if len(members) >= least
    )


MAX_RAMP_TIME = 6.0
"""s, from entry to exit; what takes longer was no shot"""


class Ramps(Device):
    """All the ramps of a table, and which balls are on their way."""

    def __init__(self, board: Playfield) -> None:
        self.last: dict[str, int] = {}
        """group → the step of its exit; the entry has the least"""
        self.first: dict[str, int] = {}
        for name, members in board.groups("ramp").items():
            self.first[name], self.last[name] = members[0].step, members[-1].step
        self.entered: dict[tuple[str, int], float] = {}
        """group and ball → when, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Follow a ball on a ramp."""
        element = hit.element
        if element.role != "ramp":
            return
        if element.group is None or self.first[element.group] == self.last[element.group]:
            yield from _made(hit)
        elif element.step == self.first[element.group]:
            self.entered[element.group, hit.ball] = hit.time
            yield PlaySound("ramp entry")
        elif element.step == self.last[element.group]:
            began = self.entered.pop((element.group, hit.ball), None)
            if began is not None and hit.time - began <= MAX_RAMP_TIME:
                yield from _made(hit)

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Forget balls that did not arrive."""
        self.entered.clear()
        return iter(())


def _made(hit: Hit) -> Iterator[Effect]:
    yield PlaySound("ramp")
    yield Award("ramp", points_of(hit), hit.element.group, 1_000, hit.ball)


PLATE_RADIUS = 0.018
"""m, from the axis to the edge that the ball carries along"""

DECAY = -math.log(0.9879) / 0.01
"""1/s: the speed falls by this share of itself. Source: Visual Pinball's default damping, .9879 every 10 ms."""

MIN_SPIN_SPEED = 4.0
"""rad/s: a slower plate does not get over the top again"""


class SpinnerDevice(Device):
    """A plate with its angle and speed.

    A ball that passes with v carries the edge along: Ω = v/r, unless it turns faster already. Then Ω falls as exp(−kt)
    and the plate has turned by Ω₀/k·(1 − exp(−kt)); what it was when a turn was full scores, one by one, in time.
    """

    def __init__(self, element: PlayfieldElement) -> None:
        self.element = element
        self.speed = 0.0
        """rad/s"""
        self.angle = 0.0
        """rad, since the last full turn"""
        self.time = 0.0
        """of both, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Set the plate turning."""
        if hit.element is self.element:
            yield from self._turned(hit.time)
            self.speed = max(self.speed, hit.speed / PLATE_RADIUS)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Score the turns until now."""
        yield from self._turned(now.time)

    def _turned(self, time: float) -> Iterator[Effect]:
        passed, self.time = time - self.time, max(time, self.time)
        if not self.speed or passed <= 0.0:
            return
        left = self.speed * math.exp(-DECAY * passed)
        self.angle += (self.speed - left) / DECAY
        self.speed = left
        while self.angle >= 2.0 * math.pi:
            self.angle -= 2.0 * math.pi
            yield PlaySound("spinner")
            yield Award("spinner", self.element.score or POINTS["spinner"], self.element.group, 10)
        if self.speed < MIN_SPIN_SPEED:
            self.speed = self.angle = 0.0


ROLES = ("bumper", "slingshot", "standup", "rollover", "gate")

TARGET_BONUS = {"standup": 100, "rollover": 100}
"""points of the bonus, each time"""

FLASH = 0.15
"""s, that a lamp flashes after a hit"""


class ScoringSwitches(Device):
    """Bumpers, slingshots, standing targets, rollovers and gates: each hit scores at once, and is seen as a flash."""

    def __init__(self) -> None:
        self.struck: dict[str, float] = {}
        """what was hit → when last, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Score a hit."""
        role = hit.element.role
        if role not in ROLES:
            return
        self.struck[hit.element.name] = hit.time
        if role != "gate":
            yield PlaySound(role)
        yield Award(role, points_of(hit), hit.element.group, TARGET_BONUS.get(role, 0), hit.ball)

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Flash what was hit a moment ago."""
        return (Light(name) for name, when in self.struck.items() if 0.0 <= now.time - when < FLASH)
