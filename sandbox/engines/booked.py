"""Booked: what is done to a running scene from outside, by what its energy was before and is after."""

from collections.abc import Iterator
from contextlib import contextmanager

from sandbox.engines.account import Account, Cause
from sandbox.engines.contract import Simulation
from sandbox.engines.energy import total_energy


@contextmanager
def booked(account: Account | None, cause: Cause, simulation: Simulation) -> Iterator[None]:
    """Enter under a cause what a simulation's energy changes by meanwhile; where there is no account, do nothing.

    What raises is not entered: it has changed nothing.
    """
    before = 0.0 if account is None else total_energy(simulation)
    yield
    if account is not None:
        account.enter(cause, total_energy(simulation) - before)
