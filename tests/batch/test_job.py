"""Jobs: runs that are computed or loaded from a store, and their rows."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from sandbox.action import Force, Remove, Spawn
from sandbox.batch import store as store_module
from sandbox.batch.job import Job, RunOptions
from sandbox.batch.store import Store, StoreError
from sandbox.jsonable import to_json
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from tests.batch.fetching import run_or_fetch
from tests.batch.test_store import files

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SCENE = loads("""
title = "Two"
world = { gravity = [0.0, -10.0], duration = 0.1, seed = 3 }
ball = [
  { name = "a", position = [0, 0], radius = 1 },
  { name = "b", position = [5, 0], radius = 1 },
]
""")
JOB = Job("label", SCENE, "pymunk")


def test_row_has_the_results_of_the_run() -> None:
    record = run_or_fetch(JOB)
    row, run = to_json(record.row()), record.trajectory
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    assert (row["id"], row["scene"], row["title"], row["seed"]) == (record.id, "label", "Two", 3)
    assert (row["status"], row["reason"], row["steps"], row["path"], row["repeated"]) == ("ok", None, 10, None, False)
    assert row["seconds"] > 0
    assert row["realtime_factor"] == pytest.approx(0.1 / row["seconds"])
    assert row["settings"] == run.info["settings"]
    assert row["final"]["b"]["position"] == run.position[-1, 1].tolist()
    assert row["final"]["b"]["velocity"] == run.velocity[-1, 1].tolist()
    assert {**row, "final": None} == {**to_json(record.row(final=False)), "final": None}
    assert "final" not in to_json(record.row(final=False))


def test_run_is_computed_once_and_then_loaded(tmp_path: Path) -> None:
    fractions: list[float] = []
    with Store(tmp_path) as store:
        computed = run_or_fetch(JOB, store, progress=fractions.append)
        assert fractions[-1] == 1.0
        fractions.clear()
        loaded = run_or_fetch(JOB, store, progress=fractions.append)
        assert fractions == []
    assert (computed.repeated, loaded.repeated, computed.id, computed.path) == (False, True, loaded.id, loaded.path)
    assert computed.path == tmp_path / f"{computed.id}.npz"
    assert np.array_equal(computed.trajectory.position, loaded.trajectory.position)
    assert replace(loaded.row(), repeated=False) == computed.row()


def test_row_names_retired_bodies_and_is_valid_json_after_divergence() -> None:
    actions = (
        Remove(time=0.05, body="a"),
        Spawn(time=0.05, ball=Ball(name="c", position=(9.0, 9.0), radius=1.0)),
        Force(time=0.05, body="b", force=(9e13, 0.0)),  # 9e11 m/s a step: out of range after twelve
    )
    longer = SCENE.model_copy(update={"world": SCENE.world.model_copy(update={"duration": 1.0})})
    row = to_json(run_or_fetch(replace(JOB, scene=longer, actions=actions)).row())
    assert (row["status"], row["retired"]) == ("diverged", {"a": 0.05})
    assert list(row["final"]) == ["a", "b", "c"]
    json.dumps(row, allow_nan=False)


def test_refused_job_has_no_final_state(tmp_path: Path) -> None:
    scene = SCENE.model_copy(update={"solver": SCENE.solver.replace(integrator="rk4")})
    with Store(tmp_path) as store:
        record = run_or_fetch(replace(JOB, scene=scene), store)
        again = run_or_fetch(replace(JOB, scene=scene), store)
    row = to_json(record.row())
    assert (row["status"], row["final"], row["realtime_factor"], row["missed_contacts"]) == ("refused", {}, None, None)
    assert again.repeated
    assert again.row().reason == row["reason"]


def test_damaged_run_is_repeated_and_replaced(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        first = run_or_fetch(JOB, store)
        first.path.write_bytes(b"damaged")
        again = run_or_fetch(JOB, store)
        assert (again.repeated, again.path) == (False, first.path)
        assert again.damaged.startswith(f"{first.path} is not a stored run: ")
        assert again.row().damaged == again.damaged
        found = run_or_fetch(JOB, store)
        assert (found.repeated, found.damaged, "damaged" in to_json(found.row())) == (True, None, False)
        assert found.trajectory.info["state_hash"] == first.trajectory.info["state_hash"]
        assert [row.seconds for row in store.rows()] == [again.trajectory.info["seconds"]]
    assert files(tmp_path) == {"runs.sqlite", first.path.name}


def test_file_of_another_run_is_repeated(tmp_path: Path) -> None:
    other = replace(JOB, scene=SCENE.model_copy(update={"title": "Three"}))
    with Store(tmp_path) as store:
        path, theirs = run_or_fetch(JOB, store).path, run_or_fetch(other, store).path
        path.write_bytes(theirs.read_bytes())
        assert run_or_fetch(JOB, store).damaged.startswith(f"{path} is not a stored run: ")
        assert run_or_fetch(JOB, store).repeated
        assert run_or_fetch(other, store).repeated


def test_run_added_without_details_is_repeated(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        first = run_or_fetch(JOB, store)
        store.add_run(first.trajectory, first.id, replace_run=True)
        assert not run_or_fetch(JOB, store).repeated
        assert run_or_fetch(JOB, store).repeated


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied"), OSError(5, "Input/output error")])
def test_stored_run_that_cannot_be_opened_raises_store_error(error, tmp_path, monkeypatch):
    def fail(_: Path) -> NoReturn:
        raise error

    with Store(tmp_path) as store:
        path = run_or_fetch(JOB, store).path
        with monkeypatch.context() as patched:
            patched.setattr(store_module, "_digest_of", fail)
            with pytest.raises(StoreError, match=rf"{path}: {error.strerror}"):
                run_or_fetch(JOB, store)


def test_summary_keeps_the_row_and_the_arrays_are_made_where_they_are_wanted(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        summary = run_or_fetch(JOB, store, RunOptions(keep="summary"))
        assert (summary.path, summary.stored.digest) == (None, None)
        again = run_or_fetch(JOB, store, RunOptions(keep="summary"))
        assert again.repeated
        assert again.row() == replace(summary.row(), repeated=True)
        assert again.row().final == summary.row().final is not None
        with pytest.raises(ValueError, match="was stored without arrays"):
            _ = again.trajectory
        whole = run_or_fetch(JOB, store)
        assert not whole.repeated
        assert whole.path is not None
        assert run_or_fetch(JOB, store, RunOptions(keep="summary")).repeated
        assert len(store.rows()) == 1
    assert whole.stored.state_hash == summary.stored.state_hash


def test_run_is_stopped_at_its_time_limit_and_tried_again(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        stopped = run_or_fetch(JOB, store, RunOptions(time_limit=1e-9))
        assert (stopped.stored.status, stopped.stored.reason) == ("failed", "stopped at the time limit of 1e-09 s")
        assert stopped.stored.is_recorded_failure
        again = run_or_fetch(JOB, store, RunOptions(time_limit=600.0))
        assert (again.repeated, again.stored.status) == (False, "ok")


@pytest.mark.parametrize("changes", [{}, {"solver": SCENE.solver.replace(integrator="rk4")}])
def test_runs_with_actions_and_refused_runs_are_loaded_again(changes: dict[str, Any], tmp_path: Path) -> None:
    actions = (Remove(time=0.05, body="a"), Remove(time=0.01, body="b"))  # not in order
    job = replace(JOB, scene=SCENE.model_copy(update=changes), actions=actions)
    with Store(tmp_path) as store:
        first, found = run_or_fetch(job, store), run_or_fetch(job, store)
    assert (first.trajectory.status, found.repeated) == ("refused" if changes else "ok", True)


def test_ledger_computed_later_keeps_the_stored_audit(tmp_path: Path) -> None:
    store = Store(tmp_path)
    run_or_fetch(JOB, store)
    again = run_or_fetch(JOB, store, RunOptions(audit=False, ledger=True))
    assert not again.repeated
    assert again.trajectory.missed_contacts == 0  # no contacts; None would mean no audit
    found = run_or_fetch(JOB, store, RunOptions(audit=False, ledger=True))
    assert (found.repeated, found.trajectory.missed_contacts, len(found.trajectory.energy)) == (True, 0, 11)
    store.close()


def test_row_has_pocketed_balls_and_spins_of_scenes_with_a_floor() -> None:
    floor = "[world]\nduration = 3\n[surface]\nsliding_friction = 0.2\nrolling_friction = 0.01\n"
    balls = '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 0.03\nvelocity = [1, 0]\n'
    balls += '[[ball]]\nname = "b"\nposition = [0, 1]\nradius = 0.03\nspin = [0, 0, 9]\n'
    scene = loads(f'{floor}{balls}[[pocket]]\nname = "hole"\nposition = [0.5, 0.0]\nradius = 0.06\n')
    row = to_json(run_or_fetch(Job("label", scene, "exact")).row())
    assert row["pocketed"] == {"a": "hole"}
    final = row["final"]["a"]
    assert (final["position"], final["velocity"], final["spin"]) == ([0.5, 0.0], [0.0, 0.0], [0.0, 0.0, 0.0])
    assert row["final"]["b"]["spin"] == [0.0, 0.0, 9.0]  # nothing stops a ball that only spins
    zoned = loads(f"{balls.replace('spin = [0, 0, 9]', '')}[[zone]]\nposition = [0.5, 0.0]\nradius = 0.06\n")
    assert run_or_fetch(Job("label", zoned, "pymunk")).row().pocketed == {}
    plain = to_json(run_or_fetch(JOB).row())
    assert plain["pocketed"] == {}
    assert "spin" not in plain["final"]["a"]
