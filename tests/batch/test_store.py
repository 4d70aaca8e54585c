import json
import os
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.action import Remove
from sandbox.batch.store import VERSION, Store, StoredRun, StoreError, run_id
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, loads
from sandbox.trajectory import Trajectory
from tests.environment import with_root_on_path

GROUND = "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
SCENE = loads(f'title = "Ünïted ✂ ../etc"\n[[ball]]\nname = "a/b"\nposition = [0, 1]\nradius = 0.5\n{GROUND}')
VERSIONS = {"sandbox": "0.1.0", "pymunk": "7.3.1"}
ID = run_id(SCENE, "pymunk", SCENE.solver, 7, VERSIONS)
OTHER = "0123456789abcdef0123"


def sample_run(**info: object) -> Trajectory:
    """Return a run of two frames of one ball, with one recorded and one missed contact."""
    return Trajectory(
        time=np.array([0.0, 0.1]),
        position=np.array([[[0.0, 1.0]], [[0.0, 0.1 + 0.2]]]),
        velocity=np.zeros((2, 1, 2)),
        angle=np.zeros((2, 1)),
        angular_velocity=np.zeros((2, 1)),
        names=np.array(["a/b"]),
        contact_time=np.array([0.05]),
        contact_pair=np.array([[0, -1]]),
        contact_point=np.zeros((1, 2)),
        contact_normal=np.array([[0.0, -1.0]]),
        contact_impulse=np.array([[0.0, -1.0]]),
        retired_time=np.array([np.nan]),
        missed_time=np.array([0.0]),
        missed_pair=np.array([[0, -1]]),
        info={
            "scene": to_document(SCENE),
            "engine": "pymunk",
            "settings": SCENE.solver.model_dump(mode="json"),
            "seed": 7,
            "status": "ok",
            "reason": None,
            "steps": 10,
            "seconds": 0.25,
            "energy_start": 9.81,
            "energy_end": 9.5,
            "audited": True,
            "versions": VERSIONS,
            **info,
        },
    )


def files(directory: Path) -> set[str]:
    return {path.name for path in directory.iterdir()}


def test_added_run_is_found_with_all_its_values(tmp_path: Path) -> None:
    with Store(tmp_path / "new" / "runs") as store:
        added = store.add(sample_run(), ID)
        assert store.find(ID) == added
        assert store.rows() == (added,)
        assert store.file(added) == tmp_path / "new" / "runs" / f"{ID}.npz"
        read = Trajectory.load(store.file(added))
    assert (added.id, added.path, added.engine, added.seed) == (ID, f"{ID}.npz", "pymunk", 7)
    assert (added.status, added.reason, added.steps, added.seconds) == ("ok", None, 10, 0.25)
    assert (added.energy_start, added.energy_end) == (9.81, 9.5)
    assert (added.contacts, added.missed_contacts) == (1, 1)
    assert added.scene_title == SCENE.title
    assert json.loads(added.settings) == SCENE.solver.model_dump(mode="json")
    assert json.loads(added.versions) == VERSIONS
    assert added.created.endswith("+00:00")
    assert np.array_equal(read.position, sample_run().position)
    assert dict(read.info) == dict(sample_run().info)


def test_reopened_store_still_holds_its_runs(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        added = store.add(sample_run(), ID)
    with Store(tmp_path) as store:
        assert store.find(ID) == added


def test_same_id_twice_keeps_the_first(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        first = store.add(sample_run(seconds=1.0), ID)
        before = store.file(first).read_bytes()
        assert store.add(sample_run(seconds=2.0), ID) == first
        assert store.rows() == (first,)
        assert store.file(first).read_bytes() == before


def test_run_added_concurrently_is_kept(tmp_path: Path) -> None:
    class Slow(Trajectory):
        def save(self, path: str | Path) -> Path:
            with Store(tmp_path) as other:
                other.add(sample_run(seconds=1.0), ID)
            return super().save(path)

    slow = Slow(**{**vars(sample_run()), "info": {**sample_run().info, "seconds": 2.0}})
    with Store(tmp_path) as store:
        assert store.add(slow, ID).seconds == 1.0
        assert len(store.rows()) == 1
    assert Trajectory.load(tmp_path / f"{ID}.npz").info["seconds"] == 1.0
    assert files(tmp_path) == {"runs.sqlite", f"{ID}.npz"}


def test_run_with_a_deleted_file_can_be_added_again(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        (tmp_path / store.add(sample_run(seconds=1.0), ID).path).unlink()
        assert store.find(ID) is None
        again = store.add(sample_run(seconds=2.0), ID)
        assert again.seconds == 2.0
        assert store.rows() == (again,)


def test_file_without_a_row_is_replaced(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        (tmp_path / f"{ID}.npz").write_bytes(b"left by a crash")
        assert store.find(ID) is None
        store.add(sample_run(), ID)
    assert Trajectory.load(tmp_path / f"{ID}.npz").status == "ok"


def test_failure_while_saving_leaves_neither_row_nor_file(tmp_path: Path) -> None:
    class Unsavable(Trajectory):
        def save(self, path: str | Path) -> Path:
            Path(path).write_bytes(b"half a file")
            raise KeyboardInterrupt

    with Store(tmp_path) as store:
        with pytest.raises(KeyboardInterrupt):
            store.add(Unsavable(**vars(sample_run())), ID)
        assert store.rows() == ()
        assert files(tmp_path) == {"runs.sqlite"}
        store.add(sample_run(), ID)


def test_failure_while_inserting_leaves_no_row(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        with pytest.raises(StoreError):
            store.add(sample_run(seed=None), ID)
        assert store.rows() == ()
        assert store.find(ID) is None
        assert store.add(sample_run(), ID) == store.find(ID)


def test_rows_are_in_insertion_order(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        for run in (OTHER, ID):
            store.add(sample_run(), run)
        assert [row.id for row in store.rows()] == [OTHER, ID]


def test_nan_is_stored_as_null(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        row = store.add(sample_run(energy_end=float("nan"), energy_start=float("inf"), audited=False), ID)
        assert (row.energy_start, row.energy_end, row.missed_contacts) == (float("inf"), None, None)
        assert store.find(ID) == row


@pytest.mark.parametrize("run", ["", "../../../../tmp/ownage", "A" * 20, ID + "\n", ID[:19], "a/b"])
def test_invalid_id_is_rejected_and_creates_no_file(tmp_path: Path, run: str) -> None:
    with Store(tmp_path) as store:
        with pytest.raises(ValueError, match="not a run id"):
            store.add(sample_run(), run)
        assert store.find(run) is None
    assert files(tmp_path) == {"runs.sqlite"}


ADDER = """
import sys
from tests.batch.test_store import Store, sample_run
sys.stdin.read(1)
with Store(sys.argv[1]) as store:
    for run in sys.argv[2:]:
        store.add(sample_run(), run)
"""


@pytest.mark.full
def test_several_processes_add_to_one_folder(tmp_path: Path) -> None:
    shared = [f"{k:020x}" for k in range(30)]
    individual = [[f"{k:010x}{n:010x}" for n in range(10)] for k in range(1, 4)]
    directory = tmp_path / "runs"
    adders = [
        subprocess.Popen(
            [sys.executable, "-c", ADDER, str(directory), *runs],
            env=with_root_on_path(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for runs in ([*shared, *individual[0]], [*reversed(shared), *individual[1]], [*individual[2], *shared])
    ]
    for adder in adders:  # they wait for this input, so that they begin together
        assert adder.stdin is not None
        adder.stdin.write("!")
        adder.stdin.flush()
    for adder in adders:
        _, stderr = adder.communicate()
        assert (adder.returncode, stderr) == (0, "")
    expected = {*shared, *(run for runs in individual for run in runs)}
    with Store(directory) as store:
        assert sorted(row.id for row in store.rows()) == sorted(expected)
        assert all(store.find(run) is not None for run in expected)
    assert files(directory) == {"runs.sqlite", *(f"{run}.npz" for run in expected)}


@pytest.mark.parametrize("below", ["", "deeper/down"])
def test_folder_that_is_a_file_is_rejected(tmp_path: Path, below: str) -> None:
    file = tmp_path / "runs"
    file.write_text("precious")
    with pytest.raises(StoreError, match=r"runs\S*: is a file"):
        Store(file / below)
    assert file.read_text() == "precious"


@pytest.fixture
def read_only() -> Iterator[Path]:
    """A folder that even root cannot write to during the test."""
    with tempfile.TemporaryDirectory() as name:
        user = os.geteuid()
        Path(name).chmod(0o555)
        if user == 0:
            os.seteuid(65534)
        try:
            yield Path(name)
        finally:
            os.seteuid(user)
            Path(name).chmod(0o755)


@pytest.mark.parametrize("below", ["", "deeper"])
def test_read_only_folder_is_rejected(read_only: Path, below: str) -> None:
    with pytest.raises(StoreError) as caught:
        Store(read_only / below)
    assert str(caught.value).startswith(f"{read_only / below}: Permission denied")


def test_invalid_folder_name_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="name a folder"):
        Store(tmp_path / ("x" * 5000))


def test_file_that_is_no_database_is_rejected_and_unchanged(tmp_path: Path) -> None:
    (tmp_path / "runs.sqlite").write_bytes(b"this is no database, " * 200)
    before = (tmp_path / "runs.sqlite").read_bytes()
    with pytest.raises(StoreError, match=r"runs\.sqlite: file is not a database; name another folder"):
        Store(tmp_path)
    assert (tmp_path / "runs.sqlite").read_bytes() == before


def test_database_that_is_a_folder_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "runs.sqlite").mkdir()
    with pytest.raises(StoreError, match=r"runs\.sqlite: unable to open database file"):
        Store(tmp_path)


def test_foreign_database_is_rejected_and_unchanged(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "runs.sqlite")) as foreign:
        foreign.execute("CREATE TABLE runs (a)")
    before = (tmp_path / "runs.sqlite").read_bytes()
    with pytest.raises(StoreError, match="not a database of runs"):
        Store(tmp_path)
    assert (tmp_path / "runs.sqlite").read_bytes() == before


def test_store_of_a_newer_version_is_rejected(tmp_path: Path) -> None:
    Store(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / "runs.sqlite")) as newer:
        newer.execute(f"PRAGMA user_version = {VERSION + 1}")
    with pytest.raises(StoreError, match=rf"written by a newer version of sandbox \(format {VERSION + 1}"):
        Store(tmp_path)


def test_store_can_be_closed_twice(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.add(sample_run(), ID)
        store.close()
        store.close()
    with Store(tmp_path) as again:
        assert again.find(ID) is not None


def test_columns_are_the_fields_of_a_row(tmp_path: Path) -> None:
    Store(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / "runs.sqlite")) as database:
        columns = [row[1] for row in database.execute("PRAGMA table_info(runs)")]
    assert columns == list(StoredRun.__dataclass_fields__)


def test_id_is_twenty_hex_digits_and_reproducible() -> None:
    assert len(ID) == 20
    assert set(ID) <= set("0123456789abcdef")
    assert run_id(loads(dumps(SCENE)), "pymunk", Settings(), 7, dict(reversed(VERSIONS.items()))) == ID


def test_id_depends_on_every_input_of_a_run() -> None:
    moved = loads(dumps(SCENE), overrides=["ball.0.position=[0, 1.0000000000000002]"])
    action = Remove(time=0.5, body="a/b")
    ids = {
        ID,
        run_id(moved, "pymunk", SCENE.solver, 7, VERSIONS),
        run_id(SCENE, "box2d", SCENE.solver, 7, VERSIONS),
        run_id(SCENE, "pymunk", SCENE.solver.replace(dt=0.02), 7, VERSIONS),
        run_id(SCENE, "pymunk", SCENE.solver, 8, VERSIONS),
        run_id(SCENE, "pymunk", SCENE.solver, 7, {**VERSIONS, "pymunk": "7.3.2"}),
        run_id(SCENE, "pymunk", SCENE.solver, 7, VERSIONS, (action,)),
        run_id(SCENE, "pymunk", SCENE.solver, 7, VERSIONS, (action, action)),
    }
    assert len(ids) == 8


def test_scene_hash_depends_on_the_scene_alone(tmp_path: Path) -> None:
    other = loads(dumps(SCENE), overrides=["world.duration=3.0"])
    with Store(tmp_path) as store:
        one = store.add(sample_run(), ID)
        same = store.add(sample_run(engine="box2d", seed=8), OTHER)
        third = store.add(replace(sample_run(), info={**sample_run().info, "scene": to_document(other)}), OTHER[::-1])
    assert one.scene_hash == same.scene_hash != third.scene_hash
