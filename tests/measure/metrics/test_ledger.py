"""Ledgers: what a run's account comes to, kept with the run."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.jsonable import to_json
from sandbox.measure.metrics.energy import Ledger, energies, ledger_of
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.accounts import ledger

SCENE = loads("""
[world]
gravity = [0.0, -10.0]
duration = 0.55
[solver]
dt = 0.01
record_every = 4
[[plane]]
point = [0, 0]
normal = [0, 1]
[[ball]]
position = [0, 1]
radius = 0.5
restitution = 0.5
""")


def test_ledger_has_a_row_for_every_frame_that_is_kept() -> None:
    kept = ledger(SCENE, "reference")
    assert kept.time.tolist() == run(SCENE, "reference").time.tolist()
    assert kept.entries.shape == (len(kept.time), len(Cause))
    assert kept.causes == tuple(Cause)
    assert not kept.entries[0].any()
    assert kept.entries[-1].any()


def test_totals_are_those_that_are_measured_of_the_frames() -> None:
    trajectory = run(SCENE, "reference", account=True)
    measured = energies(trajectory, SCENE).total
    assert trajectory.energy == pytest.approx(measured, rel=1e-15)  # sums in another order
    assert trajectory.info["energy_end"] == trajectory.energy[-1]


def test_residual_is_what_no_cause_brought() -> None:
    causes = ("restitution", "drag")
    entries = np.array([[0.0, 0.0], [-1.0, -2.0]])
    kept = Ledger(np.array([0.0, 1.0]), np.array([10.0, 6.5]), causes, entries, scale=5.0)
    assert kept.residual.tolist() == [0.0, -0.5]
    assert kept.closes_to == 0.1
    assert (kept.of(Cause.DRAG), kept.of(Cause.JOINTS)) == (-2.0, 0.0)
    told = to_json(kept.document())
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["causes"] == {"restitution": -1.0, "drag": -2.0}
    assert (told["start"], told["end"], told["residual"], told["scale"]) == (10.0, 6.5, -0.5, 5.0)


def test_figures_that_are_not_finite_are_null() -> None:
    kept = Ledger(np.zeros(2), np.array([1.0, np.inf]), ("drag",), np.array([[0.0], [np.nan]]), 1.0)
    told = to_json(kept.document())
    assert (told["end"], told["causes"]["drag"], told["residual"]) == (None, None, None)


def test_scale_is_what_was_in_motion_or_turned_over() -> None:
    assert ledger(SCENE, "reference").scale == pytest.approx(5.0, rel=0.05)  # m g · 0.5 m, where steps meet the floor
    still = SCENE.model_copy(update={"world": SCENE.world.model_copy(update={"gravity": (0.0, 0.0)})})
    nothing = ledger(still, "reference")
    assert (nothing.scale, nothing.closes_to) == (0.0, 0.0)


def test_account_is_stored_with_the_run_and_read_back(tmp_path: Path) -> None:
    kept = run(SCENE, "reference", account=True)
    found = Trajectory.load(kept.save(tmp_path / "run.npz"))
    assert found.energy.tobytes() == kept.energy.tobytes()
    assert found.account.tobytes() == kept.account.tobytes()
    assert ledger_of(found, SCENE).document() == ledger_of(kept, SCENE).document()
    part = found.at([0, -1])
    assert part.account.shape == (2, len(Cause))


def test_runs_without_an_account_have_no_ledger(tmp_path: Path) -> None:
    plain = run(SCENE, "reference")
    assert "causes" not in plain.info
    with pytest.raises(ValueError, match="account=True"):
        ledger_of(plain, SCENE)
    path = plain.save(tmp_path / "run.npz")
    with np.load(path) as arrays:  # as earlier versions stored it
        kept = {name: arrays[name] for name in arrays.files if name not in ("energy", "account")}
    np.savez_compressed(path, **kept)
    assert len(Trajectory.load(path).energy) == 0


def test_a_run_with_an_account_is_the_same_run() -> None:
    plain, kept = run(SCENE, "reference"), run(SCENE, "reference", account=True)
    assert kept.info["state_hash"] == plain.info["state_hash"]
    assert kept.position.tobytes() == plain.position.tobytes()
    assert kept.contact_impulse.tobytes() == plain.contact_impulse.tobytes()
    assert kept.info["work"] == plain.info["work"]


def test_what_only_takes_gives_phantom_energy() -> None:
    account = EnergyLedger()
    account.add(Cause.JOINTS, 2.0)
    account.add(Cause.JOINTS, -1.0)
    account.add(Cause.DRAG, 3.0)  # wind may give
    account.add_unchecked(Cause.RESTITUTION, 0.5)  # what it had lent
    entries = {cause: energy for cause, energy in account.entries().items() if energy}
    assert entries == {Cause.PHANTOM: 2.0, Cause.JOINTS: -1.0, Cause.DRAG: 3.0, Cause.RESTITUTION: 0.5}


@pytest.mark.parametrize(
    ("along", "across", "booked"),
    [
        (-2.0, -1.0, {Cause.RESTITUTION: -2.0, Cause.FRICTION: -1.0}),
        (-3.0, 1.0, {Cause.RESTITUTION: -2.0}),
        (1.0, -3.0, {Cause.FRICTION: -2.0}),
        (3.0, -1.0, {Cause.PHANTOM: 2.0}),
        (1.0, 1.0, {Cause.PHANTOM: 2.0}),
        (0.0, 0.0, {}),
    ],
)
def test_contacts_give_phantom_energy_only_together(along: float, across: float, booked: dict[Cause, float]) -> None:
    account = EnergyLedger()
    account.add_contacts(along, across)
    assert {cause: energy for cause, energy in account.entries().items() if energy} == booked


def test_a_ledger_of_frames_that_moved_elsewhere_does_not_close() -> None:
    """The check can fail: totals are not taken from the account."""
    trajectory = run(SCENE, "reference", account=True)
    wrong = replace(trajectory, energy=trajectory.energy + np.linspace(0.0, 1.0, len(trajectory.energy)))
    assert ledger_of(wrong, SCENE).closes_to > 0.1
