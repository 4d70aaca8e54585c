"""Devices of a table: coils, kickers, lane lights, ramps, spinners, and switches that only score.

- `CoilVariation`: random variation of the speed at which a solenoid ejects a ball.
- `Kickers`: holes that hold a ball for a short time, and eject it.
- `LaneLights`: a set of lamps, each lit by its own switch; a completed set scores, and its lamps go out.
- `Ramps`: score when a ball that entered at the foot leaves at the end.
- `SpinnerDevice`: a hanging plate that a passing ball spins; each turn scores.
- `ScoringSwitches`: elements that only score when hit.
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

MIN_THROW = 0.95
"""smallest random factor of the speed: coils vary, and a ball ejected identically each time could repeat its path
forever"""


class CoilVariation:
    """Reduces the speed at which a coil ejects a ball by a random factor."""

    def __init__(self, seed: int, stream: int) -> None:
        """Create the random generator of a coil.

        Args:
            seed: seed of the scene.
            stream: index of the coil; coils vary independently.
        """
        self._rng = draws(Stream.COIL, seed, stream)

    def throw(self, velocity: Vector) -> Vector:
        """Return a velocity, m/s, times a random factor from `MIN_THROW` to 1."""
        fraction = float(self._rng.uniform(MIN_THROW, 1.0))
        return velocity[0] * fraction, velocity[1] * fraction


HOLD_TIME = 0.8
"""s for which a kicker holds a ball"""


class Kickers(Device):
    """All kickers of a table, and the balls that they hold."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.coil = CoilVariation(board.seed, 1)
        self.held: dict[int, tuple[PlayfieldElement, float]] = {}
        """ball → its kicker, and the time at which it is ejected, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Hold a ball."""
        if hit.element.role != "kicker" or hit.ball in self.held:
            return
        self.held[hit.ball] = (hit.element, hit.time + HOLD_TIME)
        yield PlaySound("kicker")
        yield Award("kicker", points_of(hit), hit.element.group, 500, hit.ball)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Eject the balls whose holding time is over."""
        for ball in sorted(ball for ball, (_, when) in self.held.items() if when <= now.time):
            yield from self.eject(ball, now)

    def eject(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Eject a held ball."""
        hole, _ = self.held.pop(ball)
        x, y = now.frame.position[ball].tolist()
        yield PlaySound("eject")
        yield Move(time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(hole.out))

    def forget(self, ball: int) -> None:
        """Stop holding a ball that was removed from the kicker."""
        self.held.pop(ball, None)


BANK_AWARD: dict[Role, int] = {"rollover": 10_000, "standup": 20_000}
"""points of a completed set"""

BANK_LABELS: dict[Role, str] = {"rollover": "lanes", "standup": "standups"}
"""award kind of a completed set"""

BANK_BONUS = 2_000

EXTRA_BALL_MULTIPLIER = 4
"""bonus multiplier that awards an extra ball"""

MIN_BANK_SIZE: dict[Role, int] = {"rollover": 3, "standup": 2}
"""minimum number of elements of a set: a pair of rollovers belongs to inlanes or outlanes, which have no lamps"""


class LaneLights(Device):
    """Lamps of one group of rollovers or standup targets.

    A completed set of lanes increases the bonus multiplier by one. Raising a flipper rotates the lit lamps of lanes by
    one, to the side of the flipper.
    """

    def __init__(self, group: str, members: tuple[PlayfieldElement, ...]) -> None:
        self.group = group
        self.role = members[0].role
        self.names = tuple(each.name for each in members)
        self.lit = [False] * len(members)

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Light the lamp of the element; award a completed set."""
        if hit.element.name not in self.names:
            return
        index = self.names.index(hit.element.name)
        if self.lit[index]:
            return
        self.lit[index] = True
        yield PlaySound("lit")
        if not all(self.lit):
            return
        self.lit = [False] * len(self.lit)
        if self.role == "rollover" and now.sheet.bonus_multiplier < MAX_BONUS_MULTIPLIER:
            now.sheet.bonus_multiplier += 1
            yield ShowMessage(f"bonus × {now.sheet.bonus_multiplier}")
            if now.sheet.bonus_multiplier == EXTRA_BALL_MULTIPLIER:
                yield ExtraBall("lanes")
        yield PlaySound("set")
        yield Award(BANK_LABELS[self.role], BANK_AWARD[self.role], self.group, BANK_BONUS, hit.ball)

    def rotate(self, side: str) -> None:
        """Rotate the lit lamps of lanes by one, to the side of the flipper that was raised."""
        if self.role == "rollover":
            shift = 1 if side == "left" else -1
            self.lit = self.lit[shift:] + self.lit[:shift]

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Turn off all lamps."""
        self.lit = [False] * len(self.lit)
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Return the lit lamps."""
        return (Light(name) for name, on in zip(self.names, self.lit, strict=True) if on)


def lane_lights_of(board: Playfield) -> tuple[LaneLights, ...]:
    """Return the sets of a table that have lamps."""
    return tuple(
        LaneLights(name, members)
        for role, min_size in MIN_BANK_SIZE.items()
        for name, members in board.groups(role).items()
        if len(members) >= min_size
    )


MAX_RAMP_TIME = 6.0
"""s from entry to exit; a ball that takes longer does not score"""


class Ramps(Device):
    """All ramps of a table, and the balls on them."""

    def __init__(self, board: Playfield) -> None:
        self.last: dict[str, int] = {}
        """group → step of its exit, the largest; the entry has the smallest"""
        self.first: dict[str, int] = {}
        for name, members in board.groups("ramp").items():
            self.first[name], self.last[name] = members[0].step, members[-1].step
        self.entered: dict[tuple[str, int], float] = {}
        """group and ball → time of entry, s"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Record the entry of a ball, or award the ramp at its exit."""
        element = hit.element
        if element.role != "ramp":
            return
        if element.group is None or self.first[element.group] == self.last[element.group]:
            yield from _award_ramp(hit)
        elif element.step == self.first[element.group]:
            self.entered[element.group, hit.ball] = hit.time
            yield PlaySound("ramp entry")
        elif element.step == self.last[element.group]:
            began = self.entered.pop((element.group, hit.ball), None)
            if began is not None and hit.time - began <= MAX_RAMP_TIME:
                yield from _award_ramp(hit)

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Discard the entries of balls that did not reach the exit."""
        self.entered.clear()
        return iter(())


def _award_ramp(hit: Hit) -> Iterator[Effect]:
    yield PlaySound("ramp")
    yield Award("ramp", points_of(hit), hit.element.group, 1_000, hit.ball)


PLATE_RADIUS = 0.018
"""m, distance from the axis to the edge that the ball hits"""

SPIN_DECAY = -math.log(0.9879) / 0.01
"""1/s, decay rate of the speed. Source: Visual Pinball's default damping, a factor of 0.9879 every 10 ms."""

MIN_SPIN_SPEED = 4.0
"""rad/s: a slower plate does not complete another turn"""


class SpinnerDevice(Device):
    """A plate with its angle and speed.

    A ball that passes at speed v sets the angular velocity of the plate to Ω = v/r, unless it already turns faster.
    Then Ω decreases as exp(−kt), and the plate has turned by Ω₀/k·(1 − exp(−kt)). Each full turn scores.
    """

    def __init__(self, element: PlayfieldElement) -> None:
        self.element = element
        self.speed = 0.0
        """rad/s"""
        self.angle = 0.0
        """rad, since the last full turn"""
        self.time = 0.0
        """s, time of speed and angle"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Spin the plate."""
        if hit.element is self.element:
            yield from self._advance(hit.time)
            self.speed = max(self.speed, hit.speed / PLATE_RADIUS)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Score the turns until now."""
        yield from self._advance(now.time)

    def _advance(self, time: float) -> Iterator[Effect]:
        passed, self.time = time - self.time, max(time, self.time)
        if not self.speed or passed <= 0.0:
            return
        speed = self.speed * math.exp(-SPIN_DECAY * passed)
        self.angle += (self.speed - speed) / SPIN_DECAY
        self.speed = speed
        while self.angle >= 2.0 * math.pi:
            self.angle -= 2.0 * math.pi
            yield PlaySound("spinner")
            yield Award("spinner", self.element.score or POINTS["spinner"], self.element.group, 10)
        if self.speed < MIN_SPIN_SPEED:
            self.speed = self.angle = 0.0


ROLES = ("bumper", "slingshot", "standup", "rollover", "gate")
"""roles of the elements that `ScoringSwitches` scores"""

TARGET_BONUS = {"standup": 100, "rollover": 100}
"""points added to the bonus by each hit"""

FLASH_TIME = 0.15
"""s for which a lamp is lit after a hit"""


class ScoringSwitches(Device):
    """Bumpers, slingshots, standup targets, rollovers and gates: each hit scores, and flashes the lamp."""

    def __init__(self) -> None:
        self.struck: dict[str, float] = {}
        """element → time of its last hit, s"""

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
        """Return the lamps of the elements that were hit within `FLASH_TIME`."""
        return (Light(name) for name, when in self.struck.items() if 0.0 <= now.time - when < FLASH_TIME)
