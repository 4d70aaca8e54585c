"""Patience: a run that takes too long is given up, one that does not is the run itself."""

import numpy as np
import pytest
from runs_by_hand import scene_of

from sandbox.measure import drive
from sandbox.measure.compare.patience import TookTooLongError, patient_run
from sandbox.measure.run import run
from sandbox.scene.file import load
from sandbox.scene.shipped import find


def test_run_in_time_is_the_run() -> None:
    scene = scene_of()
    found = patient_run(scene, "pymunk", scene.solver, 1e9)
    assert np.array_equal(found.position, run(scene, "pymunk").position)
    assert found.missed_contacts is None
    assert patient_run(scene, "pymunk", scene.solver, 1e9, audit=True).missed_contacts == 0


def test_run_out_of_time_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive, "REPORT_EVERY", -1.0)  # looked at after every step
    scene = load(find("bounce"))
    with pytest.raises(TookTooLongError, match=r"given up after 0 s, \d+% done"):
        patient_run(scene, "pymunk", scene.solver, 0.0)
