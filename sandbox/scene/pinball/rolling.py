"""Rolling: how a ball runs down a slope."""

import math

from sandbox.scene.part import Vector

G = 9.81
"""m/s²"""
ROLLING = 5.0 / 7.0
"""of gravity along a slope that speeds up a solid sphere which rolls on it: see `rolling_gravity`"""


def rolling_gravity(slope: float) -> Vector:
    """Return the acceleration of a ball that rolls down a slope, rad, as gravity in the plane of the table, m/s².

    Friction F at the point of contact turns a sphere of radius r and moment I = (2/5) m r²: F r = I a / r, so that
    F = (2/5) m a, and m a = m g sin θ − F gives a = (5/7) g sin θ: it is as if the sphere were 7/5 as heavy along its
    way. A disc that lies flat in the plane, as bodies here do, cannot roll on it, so gravity itself is made smaller.
    Limits: speeds that collisions change are those of a sphere that rolls again at once.
    """
    return 0.0, -ROLLING * G * math.sin(slope)
