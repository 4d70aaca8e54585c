"""Pull: the impulses by which hands draw bodies towards them, one step at a time.

A damped spring as a soft constraint (E. Catto, "Soft Constraints", GDC 2011): with k = m·ω² and c = 2·m·ζ·ω the
impulse over a step h is that of a constraint with softness γ = 1/(h·(c + h·k)) and bias β/h, β = h·k/(c + h·k). It
is implicit, so that it is stable at any h, where a spring force would not be beyond ω·h of about 1.
"""

import math
from collections.abc import Mapping

from pydantic import ValidationError

from sandbox.action import ActionError, Impulse, Pull
from sandbox.engines.contract import Simulation

FREQUENCY = 7.5  # Hz
DAMPING = 1.0
"""as a share of the critical"""
STRENGTH = 100.0
"""The force is at most so many times the body's weight."""
GRAVITY = 9.81
"""m/s², by which that weight is reckoned where a scene has none"""


def pulled(
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
        offset: from the hand to where it holds the body, m.
        arm: from the body's centre to where it is held, m.
        velocity: of the centre, m/s.
        spin: rad/s.
        mass: kg.
        moment: of inertia, kg·m²; infinite for what does not turn.
        gravity: the scene's, m/s².
        h: the step, s.
    """
    omega = 2.0 * math.pi * FREQUENCY
    stiffness, damping = mass * omega**2, 2.0 * mass * DAMPING * omega
    softness = 1.0 / (h * (damping + h * stiffness))
    bias = stiffness / (damping + h * stiffness)

    # K maps an impulse where it is held to the change of velocity there.
    x, y = arm
    a, b, d = 1.0 / mass + y * y / moment, -x * y / moment, 1.0 / mass + x * x / moment
    a, d = a + softness, d + softness
    right = (
        -(velocity[0] - spin * y + bias * offset[0]),
        -(velocity[1] + spin * x + bias * offset[1]),
    )
    determinant = a * d - b * b
    jx, jy = (d * right[0] - b * right[1]) / determinant, (a * right[1] - b * right[0]) / determinant

    most = STRENGTH * mass * (gravity or GRAVITY) * h
    size = math.hypot(jx, jy)
    if size > most:
        jx, jy = jx * most / size, jy * most / size
    return (jx, jy), x * jy - y * jx


class Pulls:
    """Who is being pulled, and where to."""

    def __init__(self, pulls: Mapping[str, Pull] | None = None) -> None:
        self._pulls: dict[str, Pull] = dict(pulls or {})

    @property
    def pulls(self) -> Mapping[str, Pull]:
        """The hands by the names of the bodies that they hold, as they now are."""
        return dict(self._pulls)

    @property
    def any(self) -> bool:
        """Whether somebody is held."""
        return bool(self._pulls)

    def hold(self, pull: Pull, simulation: Simulation) -> None:
        """Take hold of a body, move the hand, or let go.

        Raises:
            ActionError: there is no such body, or it is fixed.
        """
        if pull.target is None:
            self._pulls.pop(pull.body, None)
            return
        # An impulse of nothing is refused where one of something would be.
        simulation.apply(Impulse(time=0.0, body=pull.body, impulse=(0.0, 0.0)))
        self._pulls[pull.body] = pull

    def act(self, simulation: Simulation, h: float) -> None:
        """Give every body that is held the impulse of one step of h, s; who is gone by now is let go."""
        frame, bodies, gravity = simulation.frame(), simulation.bodies, math.hypot(*simulation.scene.world.gravity)
        for name, pull in list(self._pulls.items()):
            number = bodies.names.index(name) if name in bodies.names else -1
            if number < 0 or pull.target is None or not frame.present[number]:
                del self._pulls[name]
                continue
            cos, sin = math.cos(frame.angle[number]), math.sin(frame.angle[number])
            arm = cos * pull.grip[0] - sin * pull.grip[1], sin * pull.grip[0] + cos * pull.grip[1]
            x, y = frame.position[number].tolist()
            vx, vy = frame.velocity[number].tolist()
            impulse, angular = pulled(
                (x + arm[0] - pull.target[0], y + arm[1] - pull.target[1]),
                arm,
                (vx, vy),
                float(frame.angular_velocity[number]),
                float(bodies.mass[number]),
                float(bodies.moment[number]),
                gravity,
                h,
            )
            try:
                simulation.apply(Impulse(time=0.0, body=name, impulse=impulse, angular=angular))
            except (ActionError, ValidationError):  # beyond the greatest speed or amount there may be: the hand slips
                del self._pulls[name]
