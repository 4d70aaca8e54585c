"""Succession: the account of a scene over all the engines that take turns at it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from sandbox.engines.account import Account, Cause
from sandbox.engines.contract import Simulation
from sandbox.engines.energy import total_energy


class Succession:
    """Energy by cause, J, of simulations one after the other; what is done between them is an action.

    Nothing is kept before entries are asked for.
    """

    def __init__(self) -> None:
        self._past: Account | None = None  # of earlier simulations, and of what is done here

    def entries(self, present: Simulation) -> Mapping[Cause, float]:
        """Return what each cause has brought since the first call, J, the present simulation's entries among them."""
        if self._past is None:
            self._past = Account()
        own = present.account()
        return {cause: energy + own[cause] for cause, energy in self._past.entries().items()}

    @contextmanager
    def passing(self, whole: Simulation, heir: Simulation) -> Iterator[None]:
        """Book what changes while an heir takes over within the whole: to `ACTIONS`, as someone asked for it."""
        if self._past is None:
            yield
            return
        energy, entries = total_energy(whole), whole.account()
        yield
        self._past = Account()
        for cause, brought in entries.items():
            self._past.add(cause, brought)
        heir.account()
        self._past.enter(Cause.ACTIONS, total_energy(whole) - energy)

    @contextmanager
    def hands(self, present: Simulation) -> Iterator[None]:
        """Book as drives what is done meanwhile: to an engine each impulse of a hand is an action like any other."""
        if self._past is None:
            yield
            return
        before = present.account()[Cause.ACTIONS]
        yield
        work = present.account()[Cause.ACTIONS] - before
        self._past.enter(Cause.DRIVES, work)
        self._past.enter(Cause.ACTIONS, -work)
