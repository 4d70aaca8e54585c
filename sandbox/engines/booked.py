"""Booked: what is done to a running scene from outside, by what its energy was before and is after."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.contract import Simulation
from sandbox.engines.energy import energy_of


def energy_in(simulation: Simulation) -> float:
    """Return the energy of all that is and moves in a simulation, as it is reported, J."""
    scene = simulation.scene
    breaks = np.full(len(scene.links), np.inf)
    for number, time in simulation.broken.items():
        breaks[number] = time
    return energy_of(simulation.frame(), simulation.bodies, scene.world.gravity, scene, breaks)[2]


@contextmanager
def booked(account: Account | None, cause: Cause, simulation: Simulation) -> Iterator[None]:
    """Enter under a cause what a simulation's energy changes by meanwhile; where there is no account, do nothing.

    What raises is not entered: it has changed nothing.
    """
    before = 0.0 if account is None else energy_in(simulation)
    yield
    if account is not None:
        account.enter(cause, energy_in(simulation) - before)
