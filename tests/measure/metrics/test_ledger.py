"""Energy ledgers of runs: their rows, residual, scale and storage."""

import json
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
world = { gravity = [0.0, -10.0], duration = 0.55 }
solver = { dt = 0.01, record_every = 4 }
plane = [{ point = [0, 0], normal = [0, 1] }]
ball = [{ position = [0, 1], radius = 0.5, restitution = 0.5 }]
""")


@pytest.mark.fail_slow(60)  # takes over half a second
def test_ledger_has_a_row_for_every_recorded_frame() -> None:
    recorded = ledger(SCENE, "reference")
    assert recorded.time.tolist() == run(SCENE, "reference").time.tolist()
    assert recorded.entries.shape == (len(recorded.time), len(Cause))
    assert recorded.causes == tuple(Cause)
    assert not recorded.entries[0].any()
    assert recorded.entries[-1].any()


def test_ledger_totals_equal_energies_measured_from_frames() -> None:
    trajectory = run(SCENE, "reference", account=True)
    measured = energies(trajectory, SCENE).total
    assert trajectory.energy == pytest.approx(measured, rel=1e-15)  # sums in a different order
    assert trajectory.info["energy_end"] == trajectory.energy[-1]


def test_residual_is_the_energy_change_without_a_cause() -> None:
    causes = ("restitution", "drag")
    entries = np.array([[0.0, 0.0], [-1.0, -2.0]])
    record = Ledger(np.array([0.0, 1.0]), np.array([10.0, 6.5]), causes, entries, scale=5.0)
    assert record.residual.tolist() == [0.0, -0.5]
    assert record.closes_to == 0.1
    assert (record.of(Cause.DRAG), record.of(Cause.JOINTS)) == (-2.0, 0.0)
    document = to_json(record.document())
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["causes"] == {"restitution": -1.0, "drag": -2.0}
    assert (document["start"], document["end"], document["residual"], document["scale"]) == (10.0, 6.5, -0.5, 5.0)


def test_non_finite_numbers_become_null() -> None:
    record = Ledger(np.zeros(2), np.array([1.0, np.inf]), ("drag",), np.array([[0.0], [np.nan]]), 1.0)
    document = to_json(record.document())
    assert (document["end"], document["causes"]["drag"], document["residual"]) == (None, None, None)


def test_scale_is_the_largest_kinetic_energy_or_turnover() -> None:
    assert ledger(SCENE, "reference").scale == pytest.approx(5.0, rel=0.05)  # m g · 0.5 m, up to the step of impact
    weightless = SCENE.model_copy(update={"world": SCENE.world.model_copy(update={"gravity": (0.0, 0.0)})})
    resting = ledger(weightless, "reference")
    assert (resting.scale, resting.closes_to) == (0.0, 0.0)


def test_account_is_stored_and_loaded_with_the_run(tmp_path: Path) -> None:
    stored = run(SCENE, "reference", account=True)
    found = Trajectory.load(stored.save(tmp_path / "run.npz"))
    assert found.energy.tobytes() == stored.energy.tobytes()
    assert found.account.tobytes() == stored.account.tobytes()
    assert ledger_of(found, SCENE).document() == ledger_of(stored, SCENE).document()
    part = found.at([0, -1])
    assert part.account.shape == (2, len(Cause))


def test_runs_without_an_account_have_no_ledger(tmp_path: Path) -> None:
    plain = run(SCENE, "reference")
    assert "causes" not in plain.info
    with pytest.raises(ValueError, match="account=True"):
        ledger_of(plain, SCENE)
    path = plain.save(tmp_path / "run.npz")
    with np.load(path) as arrays:  # as earlier versions stored it
        remaining = {name: arrays[name] for name in arrays.files if name not in ("energy", "account")}
    np.savez_compressed(path, **remaining)
    assert len(Trajectory.load(path).energy) == 0


def test_energy_gained_by_a_dissipative_cause_is_phantom() -> None:
    account = EnergyLedger()
    account.add(Cause.JOINTS, 2.0)
    account.add(Cause.JOINTS, -1.0)
    account.add(Cause.DRAG, 3.0)  # wind may add energy
    account.add_unchecked(Cause.RESTITUTION, 0.5)  # stored energy that is returned
    entries = {cause: energy for cause, energy in account.entries().items() if energy}
    assert entries == {Cause.PHANTOM: 2.0, Cause.JOINTS: -1.0, Cause.DRAG: 3.0, Cause.RESTITUTION: 0.5}


@pytest.mark.parametrize(
    ("along", "across", "booked_entries"),
    [
        (-2.0, -1.0, {Cause.RESTITUTION: -2.0, Cause.FRICTION: -1.0}), (-3.0, 1.0, {Cause.RESTITUTION: -2.0}),
        (1.0, -3.0, {Cause.FRICTION: -2.0}), (3.0, -1.0, {Cause.PHANTOM: 2.0}), (1.0, 1.0, {Cause.PHANTOM: 2.0}),
        (0.0, 0.0, {}),
    ],
)  # fmt: skip
def test_contact_energy_is_phantom_only_if_the_sum_is_positive(along, across, booked_entries):
    account = EnergyLedger()
    account.add_contacts(along, across)
    assert {cause: energy for cause, energy in account.entries().items() if energy} == booked_entries
