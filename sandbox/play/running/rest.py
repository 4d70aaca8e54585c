"""Rest: whether everything has come to it."""

import numpy as np

from sandbox.trajectory import Frame

STILL = 1e-9
"""m/s and rad/s: what is slower rests"""


def at_rest(frame: Frame) -> bool:
    """Tell whether nothing moves or turns."""
    rates = (frame.velocity, frame.angular_velocity, *(() if frame.roll is None else (frame.roll,)))
    return all(float(np.abs(rate).max(initial=0.0)) <= STILL for rate in rates)
