"""Succession: the account of a scene over all the engines that take turns at it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.contract import Simulation
from sandbox.engines.energy import energy_of


class Succession:
    """Energy by cause, J, of simulations one after the other; what is done between them is an action."""

    def __init__(self, first: Simulation) -> None:
        """Open the account of the first."""
        self._own = Account()
        self._present = first
        first.account()

    def entries(self) -> Mapping[Cause, float]:
        """Return what each cause has brought so far, J."""
        present = self._present.account()
        return {cause: energy + present[cause] for cause, energy in self._own.entries().items()}

    def pass_on(self, heir: Simulation, gained: float) -> None:
        """Go on with another simulation, whose state has so much more energy, J, than the last had."""
        for cause, energy in self._present.account().items():
            self._own.add(cause, energy)
        self._own.enter(Cause.ACTIONS, gained)
        heir.account()
        self._present = heir

    @contextmanager
    def hands(self) -> Iterator[None]:
        """Book as drives what is done meanwhile: to an engine each impulse of a hand is an action like any other."""
        before = self._present.account()[Cause.ACTIONS]
        yield
        work = self._present.account()[Cause.ACTIONS] - before
        self._own.enter(Cause.DRIVES, work)
        self._own.enter(Cause.ACTIONS, -work)


def total_energy(simulation: Simulation) -> float:
    """Return the energy of the present state, J."""
    scene, broken = simulation.scene, simulation.broken
    breaks = np.full(len(scene.links), np.inf)
    breaks[list(broken)] = list(broken.values())
    return energy_of(simulation.frame(), simulation.bodies, scene.world.gravity, scene, breaks)[2]
