"""Energy of a state, energy changes attributed to a cause, and ledgers that continue on another engine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Simulation
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.potential import Potential
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.trajectory import Frame


def energy_of(
    frame: Frame,
    bodies: Bodies,
    gravity: tuple[float, float],
    start: Scene | Setup | None = None,
    breaks: FloatArray | None = None,
) -> tuple[float, float, float]:
    """Return the kinetic, potential and total energy of a state, J, of present bodies that are not fixed.

    Args:
        frame: the state.
        bodies: at least those of the frame, with the same indices.
        gravity: of the world, m/s².
        start: scene or setup whose springs and attractions are included; None: none are.
        breaks: (J,) s, time at which each joint of the scene broke; inf if it did not. None: no joint broke.
    """
    count = len(frame.position)
    included = frame.present & ~bodies.fixed[:count]
    mass, moment = bodies.mass[:count][included], bodies.moment[:count][included]
    with np.errstate(over="ignore", invalid="ignore"):  # a diverged state squares to infinity
        speed_squared = np.einsum("nk,nk->n", frame.velocity[included], frame.velocity[included])
        kinetic = 0.5 * float(mass @ speed_squared + moment @ np.square(frame.angular_velocity[included]))
        if frame.roll is not None:
            kinetic += 0.5 * float(moment @ np.square(frame.roll[included]).sum(axis=1))
        weight = mass * bodies.gravity_scale[:count][included] if bodies.scales_gravity else mass
        potential = -float(weight @ (frame.position[included] @ np.asarray(gravity)))
        if start is not None:
            frame_bodies = bodies if count == len(bodies) else bodies.some(np.arange(count))
            stored = Potential(start, frame_bodies, breaks=breaks)
            if stored:
                state = frame.position[None], frame.angle[None], frame.present[None]
                potential += float(stored.at(np.asarray([frame.time]), *state)[0])
        return kinetic, potential, kinetic + potential


def total_energy(simulation: Simulation) -> float:
    """Return the energy of the present state, J."""
    setup, broken = simulation.setup, simulation.broken
    breaks = np.full(len(setup.joints), np.inf)
    breaks[list(broken)] = list(broken.values())
    return energy_of(simulation.frame(), simulation.bodies, setup.scene.world.gravity, setup, breaks)[2]


def record_energy_change(
    account: EnergyLedger | None, cause: Cause, simulation: Simulation
) -> AbstractContextManager[None]:
    """Attribute the energy change of a simulation within the context to a cause. Without an account do nothing.

    If the context raises, nothing is added: the simulation is unchanged then.
    """
    return NO_RECORD if account is None else _recorded_change(account, cause, simulation)


NO_RECORD: AbstractContextManager[None] = nullcontext()


@contextmanager
def _recorded_change(account: EnergyLedger, cause: Cause, simulation: Simulation) -> Iterator[None]:
    before = total_energy(simulation)
    yield
    account.add(cause, total_energy(simulation) - before)


class LedgerHandover:
    """Energy by cause, J, over consecutive simulations. Changes made between them are actions.

    Nothing is recorded before the first call of `entries`.
    """

    def __init__(self) -> None:
        self._past: EnergyLedger | None = None  # sum of earlier simulations and of handovers

    @property
    def is_on(self) -> bool:
        """Whether energy is accounted for."""
        return self._past is not None

    def entries(self, present: Simulation) -> Mapping[Cause, float]:
        """Return the energy change by each cause since the first call, J, including the present simulation's ledger."""
        present_entries = present.account()  # first: an engine may refuse
        if self._past is None:
            self._past = EnergyLedger()
        return {cause: energy + present_entries[cause] for cause, energy in self._past.entries().items()}

    @contextmanager
    def replacing(self, session: Simulation, successor: Simulation) -> Iterator[None]:
        """Attribute the energy change while `successor` replaces the present simulation to `ACTIONS`."""
        if self._past is None:
            yield
            return
        energy, entries = total_energy(session), session.account()
        yield
        self._past = EnergyLedger()
        for cause, energy_so_far in entries.items():
            self._past.add_unchecked(cause, energy_so_far)
        successor.account()
        self._past.add(Cause.ACTIONS, total_energy(session) - energy)

    @contextmanager
    def attributing_pulls(self, present: Simulation) -> Iterator[None]:
        """Attribute the work of mouse joints in the context to `DRIVES`. To an engine their impulses are actions."""
        if self._past is None:
            yield
            return
        before = present.account()[Cause.ACTIONS]
        yield
        work = present.account()[Cause.ACTIONS] - before
        self._past.add(Cause.DRIVES, work)
        self._past.add(Cause.ACTIONS, -work)
