"""Gestures: what the mouse does at a table: it aims, strokes, sets english and power, and carries the cue ball."""

import math
from collections import deque
from dataclasses import replace
from typing import Literal

from sandbox.play.billiards.cue import FASTEST, SLOWEST
from sandbox.play.billiards.person import Person
from sandbox.play.billiards.seen import Seen
from sandbox.scene.description.base import Point

Mode = Literal["aim", "stroke", "draw", "english", "power"]

FINE = 0.08
"""of the turn that the mouse asks for, with Shift"""
ROOM = 0.5
"""m that the cue can be drawn back"""
DRAWN = 0.015
"""m: a cue drawn back less strokes nothing"""
RECENT = 0.07
"""s over which the speed of a stroke is measured"""
DIAL = 90.0
"""px at unit 1 that the mouse moves from the ball's middle to its edge, and for half of the power"""
NEAR = 1.5
"""radii: nearer to the cue ball the mouse points nowhere"""


class Gestures:
    """What a hand is doing at the table."""

    def __init__(self, person: Person) -> None:
        self.person, self.game = person, person.game
        self.seen = Seen(person)
        self.mode: Mode = "aim"
        self._offset: float | None = None
        """rad, from where the mouse points to where the cue does; none before the mouse has moved"""
        self._strokes = 0
        self._drawn = 0.0
        self._deepest = 0.0
        self._recent: deque[tuple[float, float]] = deque()

    def begin(self, mode: Mode) -> None:
        """Begin to stroke, or to set english or power: a key is held."""
        self._end()
        self.mode = mode

    def end(self) -> None:
        """A key was let go of."""
        self._end()

    def _end(self) -> None:
        self.mode, self._drawn, self._deepest = "aim", 0.0, 0.0
        self._recent.clear()
        self.game.cue.back = 0.0

    def motion(self, before: Point, now: Point, pixels: tuple[float, float], fine: bool, time: float) -> None:
        """Let the mouse move.

        Args:
            before: where it pointed, m.
            now: where it points, m.
            pixels: how far it has moved, px at unit 1, to the right and downwards.
            fine: whether it is to move things a little only.
            time: of the motion, s.

        Raises:
            ActionError: a stroke cannot be played.
        """
        game = self.game
        if self.person.carried is not None:
            self.person.carry(now)
            return
        if not game.mine:
            return
        cue, share = game.cue, FINE if fine else 1.0
        if self.mode == "english":
            cue.tip_at(cue.side + share * pixels[0] / DIAL, cue.height - share * pixels[1] / DIAL)
        elif self.mode == "power":
            cue.power -= share * pixels[1] / (2.0 * DIAL)
        elif self.mode == "aim":
            self._turn(before, now, fine)
        else:
            x, y = cue.way
            self._push((now[0] - before[0]) * x + (now[1] - before[1]) * y, time)

    def _turn(self, before: Point, now: Point, fine: bool) -> None:
        cue, (x, y) = self.game.cue, self.person.place
        match = self.game.match
        if math.dist((x, y), now) < NEAR * match.layout.radius[self.game.ball]:
            return
        angle = math.atan2(now[1] - y, now[0] - x)
        if self._offset is None or self._strokes != self.game.strokes:
            self._offset, self._strokes = 0.0, self.game.strokes
        if fine:
            turned = math.remainder(angle - math.atan2(before[1] - y, before[0] - x), math.tau)
            self._offset = math.remainder(cue.aim + FINE * turned - angle, math.tau)
        cue.aim = angle + self._offset

    def nudge(self, by: float) -> None:
        """Turn the cue a little, rad."""
        if self.game.mine:
            self.game.cue.aim += by
            self._offset = (self._offset or 0.0) + by

    def strengthen(self, by: float) -> None:
        """Change the power by a share of the greatest."""
        if self.game.mine:
            self.game.cue.power += by

    def _push(self, forth: float, time: float) -> None:
        """Let the cue follow the hand along its way; what passes through the ball is a stroke."""
        self._drawn = min(self._drawn - forth, ROOM)
        self._deepest = max(self._deepest, self._drawn)
        self._recent.append((time, forth))
        while self._recent and self._recent[0][0] < time - RECENT:
            self._recent.popleft()
        self.game.cue.back = max(self._drawn, 0.0)
        if self.mode == "draw":
            self.game.cue.power = min(self.game.cue.back / ROOM, 1.0)
        elif self._drawn <= 0.0 and self._deepest >= DRAWN:
            speed = sum(each for _, each in self._recent) / RECENT
            self._end()
            self.person.shoot(min(max(speed, SLOWEST), FASTEST))
        self._drawn = max(self._drawn, 0.0)

    def press(self, at: Point, reach: float) -> bool:
        """Take the left button's press at a place; return whether the table has a use for it.

        On the cue ball, in hand, it takes it; beside all balls it takes the cue, to be drawn back and let go; while
        the ball is carried it puts it down.

        Raises:
            ActionError: the ball cannot be put there.
        """
        game, person = self.game, self.person
        if person.carried is not None:
            person.put_down()
            return True
        if not game.mine:
            return False
        match = game.match
        radius = match.layout.radius[game.ball]
        if math.dist(person.place, at) <= radius + reach:
            if match.state.in_hand is None:
                return False
            person.take_in_hand()
            return True
        if any(math.dist((x, y), at) <= r + reach for x, y, r in match.on_table.values()):
            return False
        self.begin("draw")
        return True

    def release(self, at: Point, moved: bool) -> bool:
        """Take the left button's release; return whether it ended something here.

        Raises:
            ActionError: a stroke cannot be played, or a ball put down.
        """
        if self.person.carried is not None and moved:
            self.person.put_down()
            return True
        if self.mode != "draw":
            return False
        drawn = self.game.cue.back
        self._end()
        if drawn >= DRAWN:
            self.person.shoot()
        elif not moved:
            self._name(at)
        return True

    def _name(self, at: Point) -> None:
        """Call the pocket that was clicked."""
        match, call = self.game.match, self.game.call
        pocket = match.layout.pocket_at(at)
        if pocket is not None and match.choices.pocket:
            self.person.say(replace(call, pocket=None if pocket == call.pocket else pocket))

    def name_ball(self, number: int) -> bool:
        """Call the ball that was clicked, where the rules ask for one; return whether they did.

        Raises:
            ActionError: it cannot be called now.
        """
        match, call = self.game.match, self.game.call
        name = match.layout.names[number]
        if not self.game.mine or name not in match.choices.balls:
            return False
        self.person.say(replace(call, ball=None if name == call.ball else name))
        return True
