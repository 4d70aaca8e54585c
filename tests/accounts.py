"""Accounts of energy that have to close, whoever keeps them."""

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
"""What is done, and before which step."""


def kept(
    scene: Scene, steps: int, actions: Timed = (), part: float | None = None, *, engine: str, closes: float
) -> Mapping[Cause, float]:
    """Run a scene with an account and a twin without one, which end alike; return the account, which closes.

    Args:
        scene: what is run.
        steps: how many.
        actions: what is done meanwhile.
        part: of a last step, where there is one.
        engine: on what.
        closes: to what share of the largest energy.
    """
    simulation, twin = start(scene, engine), start(scene, engine)
    assert not any(simulation.account().values())
    began = total_energy(simulation)
    seen = [began]
    for k in range(steps):
        for at, action in actions:
            if at == k:
                simulation.apply(action)
                twin.apply(action)
        simulation.step()
        twin.step()
        simulation.account()  # the exact engine books a slide in as many pieces as it is asked for
        seen.append(total_energy(simulation))
    if part is not None:
        simulation.finish(part)
        twin.finish(part)
    assert simulation.state_hash() == twin.state_hash()
    account = simulation.account()
    scale = max(np.abs(seen).max(), max(map(abs, account.values())))
    assert total_energy(simulation) - began == pytest.approx(sum(account.values()), abs=closes * scale)
    return account


def ledger(scene: Scene, engine: str = "pymunk", **settings: Any) -> Ledger:
    """Run a scene with an energy account and return its ledger; a refusal fails the test."""
    trajectory = run(scene, engine, **{"audit": False, **settings, "account": True})
    assert len(trajectory.time), trajectory.reason
    return ledger_of(trajectory, scene)
