"""Glide: a body of one degree of freedom between two stops, under a constant acceleration.

Its path is followed piece by piece: to a stop, and on after being thrown back. Each piece is a parabola, so that the
effect of a stop does not depend on the step.
"""

import math

PIECES = 16
"""The most pieces of one substep. Being thrown back takes few: each time only a part of the speed is left."""


def glide(place: float, speed: float, h: float, rate: float, end: float, bounce: float) -> tuple[float, float, int]:
    """Return place and speed after h, s, and at which stop the body is pressed: −1, 1, or 0 for none.

    Args:
        place: from its first stop, 0 to `end`.
        speed: the same a second.
        h: how long, s.
        rate: its acceleration.
        end: where the last stop is.
        bounce: the part of its speed that a stop throws back. What would be back within half of h is none.
    """
    place, left = min(max(place, 0.0), end), h
    for _ in range(PIECES):
        time, border = _reached(place, speed, rate, end)
        if time >= left:
            break
        place, speed, left = border, speed + rate * time, left - time
        stop = 1 if border == end else -1
        if stop * speed < 0.0:
            continue
        speed *= -bounce
        if stop * rate < 0.0:
            continue
        if 4.0 * abs(speed) <= stop * rate * h:
            return border, 0.0, stop
    else:
        return place, speed, 0
    place += left * (speed + 0.5 * rate * left)
    return min(max(place, 0.0), end), speed + rate * left, 0


def _reached(place: float, speed: float, rate: float, end: float) -> tuple[float, float]:
    """Return in which time a parabola first leaves the range from 0 to `end`, s, and at which of the two; else inf."""
    up, down = _rise(end - place, speed, rate), _rise(place, -speed, -rate)
    return (up, end) if up <= down else (down, 0.0)


def _rise(way: float, speed: float, rate: float) -> float:
    """Return the first time, s, at which a way of 0 or more is done and goes on; inf if it never is."""
    square = speed * speed + 2.0 * rate * way
    if square < 0.0:
        return math.inf
    root = math.sqrt(square)
    if speed >= 0.0:
        if speed + root > 0.0:
            return 2.0 * way / (speed + root)
        return 0.0 if rate > 0.0 else math.inf  # it stands on the very border
    return (root - speed) / rate if rate > 0.0 else math.inf
