"""Torque: how a drive by torque turns its body while that meets nothing. The rule is Visual Pinball's, of its flippers.

A substep: the torque ramps; the body glides under the mean of it between its stops, exactly as to when it reaches one.
"""

import math

from sandbox.engines.driving.glide import glide
from sandbox.scene.drives import TorqueDrive


class Torque:
    """The rule of one drive."""

    def __init__(self, drive: TorqueDrive, moment: float) -> None:
        """Take a drive, and the moment of inertia of its body about the hinge, kg·m²."""
        self.drive, self.moment = drive, moment
        self.rest, end = drive.stops
        self.sense = math.copysign(1.0, end - self.rest)
        """1 where the body is driven counterclockwise, else −1"""
        self._end = abs(end - self.rest)
        self._edge = max(self._end - drive.hold_within, 0.0)

    def ramped(self, torque: float, level: float, h: float) -> tuple[float, float, bool]:
        """Let a torque, N·m in the sense of the drive, go towards the one that a level asks for, for h, s.

        Returns:
            It at the end; its mean on the way; and whether it is, and was before, what is wanted. A plain tuple, as
            that is made for each step of each flipper.
        """
        drive = self.drive
        wanted = level * drive.torque if level > 0.0 else -drive.return_ratio * drive.torque
        old = torque
        if old == wanted:
            return old, old, True
        step = drive.torque * h / drive.ramp if drive.ramp > 0.0 else math.inf
        gap = wanted - old
        if abs(gap) > step:
            torque = old + math.copysign(step, gap)
            return torque, 0.5 * (old + torque), False
        share = abs(gap) / step  # of the substep in which it still goes there
        return wanted, wanted - 0.5 * gap * share, False

    def turned(self, angle: float, spin: float, mean: float, fall: float, h: float) -> tuple[float, float, int, float]:
        """Return where a body comes in h, s, that meets nothing.

        Args:
            angle: rad.
            spin: rad/s.
            mean: torque of the drive, N·m in its sense.
            fall: torque of the body's weight about the hinge, N·m.
            h: s.

        Returns:
            Its angle, rad, and spin, rad/s; the stop onto which it is pressed, −1 for its rest, 1 for its end, or 0;
            and the torque that presses it there, N·m, signed as spins are.
        """
        sense, moment = self.sense, self.moment
        driving = mean * self.drive.hold_ratio if mean > 0.0 else mean
        own = sense * fall
        place, speed, at = glide(
            sense * (angle - self.rest),
            sense * spin,
            h,
            (mean + own) / moment,
            (driving + own) / moment,
            self._edge,
            self._end,
            self.drive.bounce,
        )
        new = self.drive.stops[1] if at > 0 else self.rest + sense * place  # to the bit, whatever was added up
        press = sense * ((driving if at > 0 else mean) + own) if at else 0.0
        return new, sense * speed, at, press
