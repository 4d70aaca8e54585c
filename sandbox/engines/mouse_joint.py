"""Mouse joints: impulses that pull a body towards the mouse, one step at a time.

A damped spring as a soft constraint (E. Catto, "Soft Constraints", GDC 2011): with k = m·ω² and c = 2·m·ζ·ω the impulse
over a step h is that of a constraint with softness γ = 1/(h·(c + h·k)) and bias β/h, β = h·k/(c + h·k). It is implicit
and therefore stable at any h; a spring force would be unstable beyond ω·h of about 1.
"""

import math
from collections.abc import Mapping

from sandbox.action import ActionError, Impulse, Pull
from sandbox.engines.contract import Simulation
from sandbox.scene.errors import PartError
from sandbox.scene.geometry.vectors import rotate

FREQUENCY = 7.5  # Hz
DAMPING_RATIO = 1.0
"""fraction of critical damping"""
MAX_FORCE_WEIGHTS = 100.0
"""Largest force, in weights of the body."""
GRAVITY = 9.81
"""m/s², for the weight of a body in a scene without gravity"""


def mouse_joint_impulse(
    offset: tuple[float, float],
    arm: tuple[float, float],
    velocity: tuple[float, float],
    spin: float,
    mass: float,
    moment: float,
    gravity: float,
    h: float,
) -> tuple[tuple[float, float], float]:
    """Return the impulse on a body, N·s, and the angular impulse, N·m·s, of one step.

    Args:
        offset: displacement from the target to the grip point, m.
        arm: displacement from the body's centre to the grip point, m.
        velocity: of the centre, m/s.
        spin: rad/s.
        mass: kg.
        moment: of inertia, kg·m²; infinite if the body does not turn.
        gravity: of the scene, m/s².
        h: step, s.
    """
    omega = 2.0 * math.pi * FREQUENCY
    stiffness, damping = mass * omega**2, 2.0 * mass * DAMPING_RATIO * omega
    softness = 1.0 / (h * (damping + h * stiffness))
    bias = stiffness / (damping + h * stiffness)

    # K maps an impulse at the grip point to the change of velocity there.
    x, y = arm
    a, b, d = 1.0 / mass + y * y / moment, -x * y / moment, 1.0 / mass + x * x / moment
    a, d = a + softness, d + softness
    rhs = (
        -(velocity[0] - spin * y + bias * offset[0]),
        -(velocity[1] + spin * x + bias * offset[1]),
    )
    determinant = a * d - b * b
    if determinant > 0.0:
        jx, jy = (d * rhs[0] - b * rhs[1]) / determinant, (a * rhs[1] - b * rhs[0]) / determinant
    else:  # lost in rounding, far from the centre: Sherman–Morrison formula for K = c·1 + u·uᵀ / moment
        c = 1.0 / mass + softness
        along = (x * rhs[1] - y * rhs[0]) / (c * moment + x * x + y * y)
        jx, jy = (rhs[0] + along * y) / c, (rhs[1] - along * x) / c

    max_impulse = MAX_FORCE_WEIGHTS * mass * (gravity or GRAVITY) * h
    magnitude = math.hypot(jx, jy)
    if magnitude > max_impulse:
        jx, jy = jx * max_impulse / magnitude, jy * max_impulse / magnitude
    return (jx, jy), x * jy - y * jx


class MouseJoints:
    """Active mouse joints by the name of the body."""

    def __init__(self, pulls: Mapping[str, Pull] | None = None) -> None:
        self._pulls: dict[str, Pull] = dict(pulls or {})

    @property
    def pulls(self) -> Mapping[str, Pull]:
        """The active pulls by the name of the body."""
        return dict(self._pulls)

    @property
    def any(self) -> bool:
        """Whether there are active mouse joints."""
        return bool(self._pulls)

    def set_pull(self, pull: Pull, simulation: Simulation) -> None:
        """Create, move or remove a mouse joint.

        Raises:
            ActionError: there is no such body, or it is fixed.
        """
        if pull.target is None:
            self._pulls.pop(pull.body, None)
            return
        # A zero impulse is refused on the same bodies as any other.
        simulation.apply(Impulse(time=0.0, body=pull.body, impulse=(0.0, 0.0)))
        self._pulls[pull.body] = pull

    def apply_impulses(self, simulation: Simulation, h: float) -> None:
        """Apply the impulses of one step of h, s. Joints of bodies that have left the scene are removed."""
        frame, bodies, gravity = simulation.frame(), simulation.bodies, math.hypot(*simulation.scene.world.gravity)
        for name, pull in list(self._pulls.items()):
            index = bodies.number_of.get(name, -1)
            if index < 0 or pull.target is None or not frame.present[index]:
                del self._pulls[name]
                continue
            cos, sin = math.cos(frame.angle[index]), math.sin(frame.angle[index])
            arm = rotate(*pull.grip, cos, sin)
            x, y = frame.position[index].tolist()
            vx, vy = frame.velocity[index].tolist()
            impulse, angular = mouse_joint_impulse(
                (x + arm[0] - pull.target[0], y + arm[1] - pull.target[1]),
                arm,
                (vx, vy),
                float(frame.angular_velocity[index]),
                float(bodies.mass[index]),
                float(bodies.moment[index]),
                gravity,
                h,
            )
            try:
                simulation.apply(Impulse(time=0.0, body=name, impulse=impulse, angular=angular))
            except (ActionError, PartError):  # the speed or impulse exceeds its limit: remove the joint
                del self._pulls[name]
