"""Between: the picture that lies between two states."""

import numpy as np

from sandbox.trajectory import Frame


def between(before: Frame, after: Frame, share: float) -> Frame:
    """Return the state that lies a share (0 to 1) of the way from one to the next, on straight lines.

    A body that is not in both is as in the later one; so is one that was put elsewhere, farther than it flies.
    """
    if share >= 1.0 or before is after:
        return after
    known = len(before.position)
    time = before.time + (after.time - before.time) * share
    position, angle = after.position.copy(), after.angle.copy()
    with np.errstate(all="ignore"):
        moved = after.position[:known] - before.position
        turned = after.angle[:known] - before.angle
        dt = abs(after.time - before.time)
        speed = np.maximum(np.abs(before.velocity), np.abs(after.velocity[:known])).sum(axis=1)
        flew = np.abs(moved).sum(axis=1) <= 4.0 * speed * dt + 1e-9
        flew &= before.present & after.present[:known]
        position[:known][flew] -= moved[flew] * (1.0 - share)
        angle[:known][flew] -= turned[flew] * (1.0 - share)
    return Frame(time, position, after.velocity, angle, after.angular_velocity, after.present)
