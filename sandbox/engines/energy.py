"""Energy: what the bodies of a running scene have in one state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.potential import Potential
from sandbox.trajectory import FloatArray, Frame

if TYPE_CHECKING:
    from sandbox.engines.contract import Simulation


def energy_of(
    frame: Frame,
    bodies: Bodies,
    gravity: tuple[float, float],
    scene: Scene | None = None,
    breaks: FloatArray | None = None,
) -> tuple[float, float, float]:
    """Return the kinetic, potential and total energy of one state, J; of those who are there and move.

    Args:
        frame: the state.
        bodies: at least those of the frame, numbered alike.
        gravity: m/s².
        scene: whose springs and attractions count too; without, none do.
        breaks: (J,) s, when each of the scene's joints broke; inf where it never did, without, none did.
    """
    count = len(frame.position)
    counts = frame.present & ~bodies.fixed[:count]
    mass, moment = bodies.mass[:count][counts], bodies.moment[:count][counts]
    with np.errstate(over="ignore", invalid="ignore"):  # a diverged state squares to infinity
        squared = np.einsum("nk,nk->n", frame.velocity[counts], frame.velocity[counts])
        kinetic = 0.5 * float(mass @ squared + moment @ np.square(frame.angular_velocity[counts]))
        if frame.roll is not None:
            kinetic += 0.5 * float(moment @ np.square(frame.roll[counts]).sum(axis=1))
        potential = -float(mass @ (frame.position[counts] @ np.asarray(gravity)))
        if scene is not None:
            known = bodies if count == len(bodies) else bodies.some(np.arange(count))
            stored = Potential(scene, known, breaks=breaks)
            if stored:
                state = frame.position[None], frame.angle[None], frame.present[None]
                potential += float(stored.at(np.asarray([frame.time]), *state)[0])
        return kinetic, potential, kinetic + potential


def total_energy(simulation: Simulation) -> float:
    """Return the energy of the present state, J."""
    scene, broken = simulation.scene, simulation.broken
    breaks = np.full(len(scene.links), np.inf)
    breaks[list(broken)] = list(broken.values())
    return energy_of(simulation.frame(), simulation.bodies, scene.world.gravity, scene, breaks)[2]
