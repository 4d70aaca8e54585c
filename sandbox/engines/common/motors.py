"""Motion of driven bodies: hinges with torque and stops, hinges at a constant rate, and plungers.

`HingeDrive` turns a body by a torque, without contacts. The law is that of Visual Pinball's flippers: the current of
the coil ramps towards a target torque at `torque / ramp` per second. Within `hold_within` of the end the target torque
is that of the weaker hold coil: it is multiplied by b + hold_ratio·(1 − b), b = (d / hold_within)⁴, d the angle left,
on the way up and on the way back (`FlipperMoverObject::UpdateVelocities`, src/physics/hitflipper.cpp).

In a substep the torque ramps, and the body moves between its stops under the mean of that torque; the times at which it
reaches a stop are exact. Where the target torque depends on the angle, the substep is divided into pieces that each
cross a part of that range.

`advance_between_stops` moves a body of one degree of freedom between two stops under a constant acceleration. Its path
consists of parabolas, one to each bounce at a stop, so that the effect of a stop does not depend on the step.
"""

import math
from typing import NamedTuple

from sandbox.scene.description.base import Point
from sandbox.scene.description.forces import PlungerDrive, StrokeDrive, TorqueDrive

MAX_BOUNCES = 16
"""Largest number of parabolas in a substep. Bounces need few: each leaves only a fraction of the speed."""


def advance_between_stops(
    position: float, speed: float, h: float, acceleration: float, end: float, bounce: float
) -> tuple[float, float, int]:
    """Return the position and speed after h, s, and the stop that the body is pressed against: −1, 1, or 0 for none.

    Args:
        position: position from the first stop, 0 to `end`.
        speed: per second.
        h: duration, s.
        acceleration: constant, per second².
        end: position of the last stop.
        bounce: restitution of a stop. A bounce that would return within half of h is suppressed.
    """
    position, remaining = min(max(position, 0.0), end), h
    for _ in range(MAX_BOUNCES):
        time, limit = _first_limit(position, speed, acceleration, end)
        if time >= remaining:
            break
        position, speed, remaining = limit, speed + acceleration * time, remaining - time
        stop = 1 if limit == end else -1
        if stop * speed < 0.0:
            continue
        speed *= -bounce
        if stop * acceleration < 0.0:
            continue
        if 4.0 * abs(speed) <= stop * acceleration * h:
            return limit, 0.0, stop
    else:
        return position, speed, 0
    position += remaining * (speed + 0.5 * acceleration * remaining)
    return min(max(position, 0.0), end), speed + acceleration * remaining, 0


def _first_limit(position: float, speed: float, acceleration: float, end: float) -> tuple[float, float]:
    """Return the time, s, at which a parabola first leaves the range from 0 to `end`, inf if never, and that limit."""
    up, down = _time_to_reach(end - position, speed, acceleration), _time_to_reach(position, -speed, -acceleration)
    return (up, end) if up <= down else (down, 0.0)


def _time_to_reach(distance: float, speed: float, acceleration: float) -> float:
    """Return the first time, s, at which a displacement of 0 or more is reached and still grows; inf if never."""
    square = speed * speed + 2.0 * acceleration * distance
    if square < 0.0:
        return math.inf
    root = math.sqrt(square)
    if speed >= 0.0:
        if speed + root > 0.0:
            return 2.0 * distance / (speed + root)
        return 0.0 if acceleration > 0.0 else math.inf  # at rest exactly at the limit
    return (root - speed) / acceleration if acceleration > 0.0 else math.inf


PIECES_OF_RANGE = 8
"""Pieces in which a body crosses the range of the hold coil; the error of the speed at the stop is then below 0.1 %."""

MAX_PIECES = 32
"""Largest number of pieces of a substep. A range so small that it would need more has no effect on the speed."""


class HingeState(NamedTuple):
    """State of a hinged body at the end of a substep without contacts."""

    angle: float
    """rad"""
    spin: float
    """rad/s"""
    stop: int
    """stop that the body is pressed against: −1 for its rest, 1 for its end, or 0 for none"""
    press: float
    """N·m, torque that presses it there; signed as angular velocities are"""
    torque: float
    """N·m, of the drive at the end of the substep, positive in its direction"""
    is_steady: bool
    """whether the torque was at its target throughout the substep"""


class HingeDrive:
    """Torque law of one hinge drive."""

    def __init__(self, drive: TorqueDrive, moment: float) -> None:
        """Create the law of a drive, for a body with a moment of inertia about the hinge, kg·m²."""
        self.drive, self.moment = drive, moment
        self.rest, end = drive.stops
        self.sense = math.copysign(1.0, end - self.rest)
        """1 if the drive turns the body counterclockwise, else −1"""
        self._end = abs(end - self.rest)
        self._hold_begin = self._end - drive.hold_within if drive.hold_ratio < 1.0 else self._end

    def turn(
        self, angle: float, spin: float, torque: float, level: float, weight_torque: float, h: float
    ) -> HingeState:
        """Return the state of a body after h, s, without contacts.

        Args:
            angle: rad.
            spin: rad/s.
            torque: of the drive, N·m, positive in its direction.
            level: of the drive.
            weight_torque: torque of the body's weight about the hinge, N·m.
            h: substep, s.
        """
        sense, end = self.sense, self._end
        position, speed, signed_weight_torque = sense * (angle - self.rest), sense * spin, sense * weight_torque
        count = self._pieces(position, speed, signed_weight_torque, h)
        piece, is_steady = h / count, True
        for _ in range(count):
            if not self.drive.ramp:
                torque = self._target_torque(level, position)
            predicted = position + piece * (speed + 0.5 * piece * (torque + signed_weight_torque) / self.moment)
            target = self._target_torque(level, min(max(predicted, 0.0), end))
            is_steady = is_steady and torque == target
            torque, mean_torque = self._ramp(torque, target, piece)
            position, speed, stop = advance_between_stops(
                position, speed, piece, (mean_torque + signed_weight_torque) / self.moment, end, self.drive.bounce
            )
        new_angle = self.drive.stops[1] if stop > 0 else self.rest + sense * position  # the stop's exact angle
        return HingeState(
            new_angle,
            sense * speed,
            stop,
            sense * (mean_torque + signed_weight_torque) if stop else 0.0,
            torque,
            is_steady,
        )

    def _pieces(self, position: float, speed: float, weight_torque: float, h: float) -> int:
        """Return the number of pieces that a substep is divided into."""
        max_displacement = h * (abs(speed) + 0.5 * h * (self.drive.torque + abs(weight_torque)) / self.moment)
        if self._hold_begin == self._end or position + max_displacement <= self._hold_begin:
            return 1
        pieces = PIECES_OF_RANGE * max_displacement / self.drive.hold_within
        return max(math.ceil(pieces), 1) if pieces < MAX_PIECES else MAX_PIECES  # also for nan, after divergence

    def _target_torque(self, level: float, position: float) -> float:
        """Return the target torque of a level at an angle from the rest, rad; N·m, positive in its direction."""
        drive = self.drive
        target = level * drive.torque if level > 0.0 else -drive.return_ratio * drive.torque
        if position > self._hold_begin:
            fade = ((self._end - position) / drive.hold_within) ** 4
            target *= fade + drive.hold_ratio * (1.0 - fade)
        return target

    def _ramp(self, torque: float, target: float, h: float) -> tuple[float, float]:
        """Return the torque after ramping towards a target for h, s, and its mean over h, N·m."""
        difference = target - torque
        if difference == 0.0 or not self.drive.ramp:
            return target, 0.5 * (torque + target)
        max_change = self.drive.torque * h / self.drive.ramp
        if abs(difference) > max_change:
            new_torque = torque + math.copysign(max_change, difference)
            return new_torque, 0.5 * (torque + new_torque)
        fraction = abs(difference) / max_change  # fraction of h in which the torque still changes
        return target, target - 0.5 * difference * fraction


def hinge_to_centre(hinge: Point, angle: float) -> Point:
    """Return the displacement, m, from a hinge to the body's centre of mass at an angle, rad.

    Args:
        hinge: in the body's frame, m.
        angle: rad.
    """
    x, y = hinge
    cos, sin = math.cos(angle), math.sin(angle)
    return sin * y - cos * x, -sin * x - cos * y


def centre_about_pivot(hinge: Point, pivot: Point, angle: float, spin: float) -> tuple[Point, Point]:
    """Return the position, m, and the velocity, m/s, of the centre of mass of a body on a hinge.

    Args:
        hinge: in the body's frame, m.
        pivot: position of the hinge in the world, m.
        angle: rad.
        spin: rad/s.
    """
    dx, dy = hinge_to_centre(hinge, angle)
    return (pivot[0] + dx, pivot[1] + dy), (0.0 - spin * dy, 0.0 + spin * dx)  # never −0


def gravity_torque(hinge: Point, angle: float, mass: float, gravity: Point) -> float:
    """Return the torque, N·m, of a body's weight about its hinge; mass in kg, gravity in m/s²."""
    gx, gy = gravity
    if not (gx or gy):
        return 0.0
    dx, dy = hinge_to_centre(hinge, angle)
    return mass * (dx * gy - dy * gx)


class PlungerState(NamedTuple):
    """State of a plunger at the end of a substep."""

    pull: float
    """m, distance by which it is drawn back"""
    rate: float
    """m/s, rate at which that grows"""
    arrives: bool
    """whether it stands still from the end of the substep on"""


def rate_after_level_change(old_level: float, level: float, rate: float) -> float:
    """Return the rate, m/s, of a plunger after a change of its level. A released plunger starts at rest."""
    return 0.0 if not level > 0.0 and old_level > 0.0 else rate


def advance_plunger(drive: PlungerDrive, level: float, pull: float, rate: float, h: float) -> PlungerState:
    """Advance a plunger from a pull, m, and its rate, m/s, by h, s: drawn by hand, or moved forward by its spring."""
    target = level * drive.travel
    if pull == target:  # a spring reaches this only if it was stopped there
        return PlungerState(pull, 0.0, False)
    return _draw_back(drive, target, pull, h) if target > 0.0 else _spring_forward(drive, pull, rate, h)


def _draw_back(drive: PlungerDrive, target: float, pull: float, h: float) -> PlungerState:
    """Move towards the target pull, m, at the speed of the hand."""
    rate = drive.travel / drive.draw_time
    arrives = abs(target - pull) <= rate * h
    rate = math.copysign(rate, target - pull)
    return PlungerState(target if arrives else pull + rate * h, rate, arrives)


def _spring_forward(drive: PlungerDrive, pull: float, rate: float, h: float) -> PlungerState:
    """Move forward by the spring for a substep, or up to the stop, with the speed at that moment."""
    omega = drive.speed / drive.travel
    cos, sin = math.cos(omega * h), math.sin(omega * h)
    new_pull, new_rate = pull * cos + rate / omega * sin, rate * cos - pull * omega * sin
    if new_pull <= 0.0:
        return PlungerState(0.0, -math.hypot(pull * omega, rate), True)
    return PlungerState(new_pull, new_rate, False)


def stroke_direction(drive: PlungerDrive) -> Point:
    """Return the direction of the stroke of a plunger, of length 1."""
    x, y = drive.direction
    length = math.hypot(x, y)
    return x / length, y / length


def plunger_state(home: Point, direction: Point, pull: float, rate: float) -> tuple[Point, Point]:
    """Return the position, m, and the velocity, m/s, of a plunger's body.

    Args:
        home: position at pull 0, m.
        direction: of the stroke, of length 1.
        pull: m.
        rate: of the pull, m/s.
    """
    vx, vy = 0.0 - rate * direction[0], 0.0 - rate * direction[1]  # never −0
    return (home[0] - pull * direction[0], home[1] - pull * direction[1]), (vx, vy)


class RateHingeState(NamedTuple):
    """State of a body on a constant-rate hinge at the end of a substep."""

    angle: float
    """rad"""
    spin: float
    """rad/s, while it moves"""
    arrives: bool
    """whether it stands still from the end of the substep on"""


def turn_at_rate(drive: StrokeDrive, level: float, angle: float, h: float) -> RateHingeState:
    """Turn a body on a constant-rate hinge from an angle, rad, for h, s."""
    is_on = level > 0.0
    stop = drive.stops[is_on]
    remaining = stop - angle
    rate = drive.rate if is_on or drive.return_rate is None else drive.return_rate
    arrives = abs(remaining) <= rate * h
    if not remaining or not rate:
        return RateHingeState(angle, 0.0, arrives)
    spin = math.copysign(rate, remaining)
    return RateHingeState(stop if arrives else angle + spin * h, spin, arrives)
