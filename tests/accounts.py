"""Energy accounts that must balance, on any engine."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.measure.metrics.energy import Ledger, ledger_of
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene

Timed = Sequence[tuple[int, Action]]
"""Actions, each with the index of the step before which it is applied."""


def closed_account(
    scene: Scene, steps: int, actions: Timed = (), part: float | None = None, *, engine: str, closes: float
) -> Mapping[Cause, float]:
    """Run a scene with an account and without one; check that both end alike and that the account balances; return it.

    Args:
        scene: scene that is run.
        steps: number of whole steps.
        actions: actions and the steps before which they are applied.
        part: fraction of a last, cut step; None for none.
        engine: name of the engine.
        closes: largest error of the balance, as a fraction of the largest energy.
    """
    simulation, twin = start(scene, engine), start(scene, engine)
    assert not any(simulation.account().values())
    start_energy = total_energy(simulation)
    energies = [start_energy]
    for k in range(steps):
        for index, action in actions:
            if index == k:
                simulation.apply(action)
                twin.apply(action)
        simulation.step()
        twin.step()
        simulation.account()  # the exact engine books a slide in as many pieces as there are calls
        energies.append(total_energy(simulation))
    if part is not None:
        simulation.finish(part)
        twin.finish(part)
    assert simulation.state_hash() == twin.state_hash()
    account = simulation.account()
    scale = max(np.abs(energies).max(), max(map(abs, account.values())))
    assert total_energy(simulation) - start_energy == pytest.approx(sum(account.values()), abs=closes * scale)
    return account


def ledger(scene: Scene, engine: str = "pymunk", **settings: Any) -> Ledger:
    """Run a scene with an energy account and return its ledger; a refusal fails the test."""
    trajectory = run(scene, engine, **{"audit": False, **settings, "account": True})
    assert len(trajectory.time), trajectory.reason
    return ledger_of(trajectory, scene)
