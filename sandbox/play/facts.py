"""Facts: what is told in words of a body and of settings."""

import math

from sandbox.play.instruments.figures import figure
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.bodies import Box, Capsule
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame


def facts(bodies: Bodies, frame: Frame, contacts: Contacts, number: int) -> tuple[str, ...]:
    """Return lines about a body: its name, then its figures."""
    if number >= len(frame.position):
        return ()
    (x, y), (vx, vy) = frame.position[number].tolist(), frame.velocity[number].tolist()
    spin, angle = float(frame.angular_velocity[number]), float(frame.angle[number])
    mass, moment = float(bodies.mass[number]), float(bodies.moment[number])
    lines = [bodies.names[number]]
    if not frame.present[number]:
        return (*lines, "removed")
    if bodies.fixed[number]:
        lines.append("fixed")
    else:
        speed = math.hypot(vx, vy)
        kinetic = 0.5 * (mass * speed * speed + moment * spin * spin)
        lines += [
            f"v {figure(vx, 'm/s')}, {figure(vy, 'm/s')}",
            f"|v| {figure(speed, 'm/s')}",
            f"ω {figure(spin, 'rad/s')}",
            f"E kin {figure(kinetic, 'J')}",
        ]
    lines.insert(1, f"x {figure(x, 'm')}, {figure(y, 'm')}")
    lines.append(f"m {figure(mass, 'kg')}, {_size(bodies, number)}")
    if not (bodies.fixed[number] or bodies.round[number]):  # of a disc it is ½ m r²
        lines.append(f"I {figure(moment, 'kg·m²')}")
    if angle:
        lines.append(f"angle {figure(angle, 'rad')}")
    touching = int((contacts.pair == number).any(axis=1).sum()) if len(contacts) else 0
    if touching:
        lines.append(f"{touching} contact{'s' if touching > 1 else ''}")
    return tuple(lines)


def _size(bodies: Bodies, number: int) -> str:
    """Return in words how large a body is, by what its kind is known by."""
    element = bodies.elements[int(bodies.element[number])]
    if isinstance(element, Box | Stack):
        return f"{figure(element.size[0], 'm')} × {figure(element.size[1], 'm')}"
    if isinstance(element, Capsule):
        return f"l {figure(element.length, 'm')}, r {figure(element.radius, 'm')}"
    word = "r" if bodies.round[number] else "reach"
    return f"{word} {figure(float(bodies.radius[number]), 'm')}"


def told(settings: Settings) -> str:
    """Return settings in a few words; what an engine has no choice of is left out."""
    words = [f"dt {figure(settings.dt, 's')}"]
    if settings.integrator is not None:
        words.append(f"{settings.substeps} × {settings.iterations}")
        words.append(settings.integrator.replace("_", " "))
        if settings.detection not in (None, "discrete"):
            words.append(str(settings.detection))
        if settings.response not in (None, "impulse"):
            words.append(str(settings.response))
    return " · ".join(words)
