"""Torque: how a drive by torque turns its body while that meets nothing. The rule is Visual Pinball's, of its flippers.

The current of the coil goes towards a wanted torque at `torque / ramp` a second. Within `hold_within` of the end the
wanted torque is that of the weaker hold coil: it is multiplied by b + hold_ratio·(1 − b), b = (d / hold_within)⁴, d
the angle left, on the way up and on the way back (`FlipperMoverObject::UpdateVelocities`, src/physics/hitflipper.cpp).

A substep: the torque ramps; the body glides under the mean of it between its stops, exactly as to when it reaches one.
Where the wanted torque depends on the angle, a substep is cut into pieces that cross a part of that range each.
"""

import math
from typing import NamedTuple

from sandbox.engines.driving.glide import glide
from sandbox.scene.drives import TorqueDrive

PIECES_OF_RANGE = 8
"""Pieces in which a body crosses the range of the hold coil: speeds at the stop are right within 0.1 % then."""

MAX_PIECES = 32
"""of one substep: a range so small that more would be needed has no effect on the speed"""


class Turned(NamedTuple):
    """Where a substep brings a body that meets nothing."""

    angle: float
    """rad"""
    spin: float
    """rad/s"""
    at: int
    """the stop onto which it is pressed: −1 for its rest, 1 for its end, or 0"""
    press: float
    """N·m, what presses it there; signed as spins are"""
    torque: float
    """of the drive at the end of the substep, N·m in its sense"""
    steady: bool
    """the torque was the wanted one throughout"""


class Torque:
    """The rule of one drive."""

    def __init__(self, drive: TorqueDrive, moment: float) -> None:
        """Take a drive, and the moment of inertia of its body about the hinge, kg·m²."""
        self.drive, self.moment = drive, moment
        self.rest, end = drive.stops
        self.sense = math.copysign(1.0, end - self.rest)
        """1 where the body is driven counterclockwise, else −1"""
        self._end = abs(end - self.rest)
        self._edge = self._end - drive.hold_within if drive.hold_ratio < 1.0 else self._end

    def turn(self, angle: float, spin: float, torque: float, level: float, fall: float, h: float) -> Turned:
        """Return where a body comes in h, s, that meets nothing.

        Args:
            angle: rad.
            spin: rad/s.
            torque: of the drive, N·m in its sense.
            level: that is asked for.
            fall: torque of the body's weight about the hinge, N·m.
            h: s.
        """
        sense, end = self.sense, self._end
        place, speed, own = sense * (angle - self.rest), sense * spin, sense * fall
        count = self._pieces(place, speed, own, h)
        piece, steady = h / count, True
        for _ in range(count):
            if not self.drive.ramp:
                torque = self._wanted(level, place)
            ahead = place + piece * (speed + 0.5 * piece * (torque + own) / self.moment)
            wanted = self._wanted(level, min(max(ahead, 0.0), end))
            steady = steady and torque == wanted
            torque, mean = self._ramp(torque, wanted, piece)
            place, speed, at = glide(place, speed, piece, (mean + own) / self.moment, end, self.drive.bounce)
        new = self.drive.stops[1] if at > 0 else self.rest + sense * place  # to the bit, whatever was added up
        return Turned(new, sense * speed, at, sense * (mean + own) if at else 0.0, torque, steady)

    def _pieces(self, place: float, speed: float, own: float, h: float) -> int:
        """Return into how many pieces a substep is cut."""
        reach = h * (abs(speed) + 0.5 * h * (self.drive.torque + abs(own)) / self.moment)
        if self._edge == self._end or place + reach <= self._edge:
            return 1
        return min(max(math.ceil(PIECES_OF_RANGE * reach / self.drive.hold_within), 1), MAX_PIECES)

    def _wanted(self, level: float, place: float) -> float:
        """Return the torque that a level asks for at so many rad from the rest, N·m in the sense of the drive."""
        drive = self.drive
        wanted = level * drive.torque if level > 0.0 else -drive.return_ratio * drive.torque
        if place > self._edge:
            fade = ((self._end - place) / drive.hold_within) ** 4
            wanted *= fade + drive.hold_ratio * (1.0 - fade)
        return wanted

    def _ramp(self, torque: float, wanted: float, h: float) -> tuple[float, float]:
        """Return the torque after h, s, of going towards the wanted one, and its mean on the way, N·m."""
        gap = wanted - torque
        if gap == 0.0 or not self.drive.ramp:
            return wanted, 0.5 * (torque + wanted)
        step = self.drive.torque * h / self.drive.ramp
        if abs(gap) > step:
            new = torque + math.copysign(step, gap)
            return new, 0.5 * (torque + new)
        share = abs(gap) / step  # of the time in which it still changes
        return wanted, wanted - 0.5 * gap * share
