"""Tension: what springs give in a state, as pymunk has them: −k (l − l₀) − c l̇, and no less where that pushes."""

import numpy as np

from sandbox.scene.links import Links
from sandbox.trajectory import FloatArray, IntArray


def tension(
    links: Links, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray
) -> FloatArray:
    """Return the size of the force of springs, (K,) N.

    Args:
        links: K springs.
        position: (N, 2) m.
        velocity: (N, 2) m/s.
        angle: (N,) rad.
        spin: (N,) rad/s.
    """
    bodies = position, velocity, angle, spin
    place_a, speed_a = _end(links.a, links.anchor_a, *bodies)
    place_b, speed_b = _end(links.b, links.anchor_b, *bodies)
    way, parting = place_b - place_a, speed_b - speed_a
    length = np.hypot(way[:, 0], way[:, 1])
    rest, stiffness, damping = links.figures.T
    rate = np.einsum("kd,kd->k", way, parting) / np.where(length > 0.0, length, 1.0)
    return np.asarray(np.abs(stiffness * (length - rest) + damping * rate))


def spring_forces(links: Links, position: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the forces (N, 2), N, that springs exert on bodies by their stiffness alone.

    Args:
        links: K springs.
        position: (N, 2) m.
        angle: (N,) rad.
    """
    still = np.zeros_like(position), angle, np.zeros_like(angle)
    place_a, _ = _end(links.a, links.anchor_a, position, *still)
    place_b, _ = _end(links.b, links.anchor_b, position, *still)
    way = place_b - place_a
    length = np.hypot(way[:, 0], way[:, 1])
    rest, stiffness, _ = links.figures.T
    force = way * np.divide(stiffness * (rest - length), length, out=np.zeros_like(length), where=length > 0.0)[:, None]
    total = np.zeros((len(position) + 1, 2))  # the last is the world's: −1
    np.add.at(total, links.b, force)
    np.subtract.at(total, links.a, force)
    return total[:-1]


def torsion(links: Links, angle: FloatArray, spin: FloatArray) -> FloatArray:
    """Return the size of the torque of rotary springs, (K,) N·m."""
    moves = links.a >= 0
    turned = angle[links.b] - np.where(moves, angle[links.a], 0.0)
    rate = spin[links.b] - np.where(moves, spin[links.a], 0.0)
    rest, stiffness, damping = links.figures.T
    return np.asarray(np.abs(stiffness * (turned - rest) + damping * rate))


def _end(
    number: IntArray,
    anchor: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    angle: FloatArray,
    spin: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return where links hold their first or second bodies, (K, 2) m, and how fast that place moves, (K, 2) m/s."""
    place, speed, own = position[number], velocity[number], anchor.any(axis=1)
    if own.any():  # most hold bodies by their middles
        at, (x, y) = number[own], anchor[own].T
        cos, sin, rate = np.cos(angle[at]), np.sin(angle[at]), spin[at]
        arm_x, arm_y = cos * x - sin * y, sin * x + cos * y
        place[own] += np.column_stack((arm_x, arm_y))
        speed[own] += np.column_stack((-rate * arm_y, rate * arm_x))
    world = number < 0
    if world.any():
        place[world], speed[world] = anchor[world], 0.0
    return place, speed
