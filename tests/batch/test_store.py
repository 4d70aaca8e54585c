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
from typing import Any, NoReturn

import numpy as np
import pytest

from sandbox.action import Remove
from sandbox.batch import store as module
from sandbox.batch.store import VERSION, Store, StoreError, run_id
from sandbox.batch.stored_run import StoredRun
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
    """Return the names of the files of a store, but for those of an open database in WAL mode."""
    names = {path.name for path in directory.iterdir()}
    return names - {"runs.sqlite-wal", "runs.sqlite-shm"}


def test_added_run_is_found_with_all_its_values(tmp_path: Path) -> None:
    with Store(tmp_path / "new" / "runs") as store:
        added = store.add_run(sample_run(), ID)
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
        added = store.add_run(sample_run(), ID)
    with Store(tmp_path) as store:
        assert store.find(ID) == added


def test_same_id_twice_keeps_the_first(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        first = store.add_run(sample_run(seconds=1.0), ID)
        before = store.file(first).read_bytes()
        assert store.add_run(sample_run(seconds=2.0), ID) == first
        assert store.rows() == (first,)
        assert store.file(first).read_bytes() == before


def test_run_added_concurrently_is_kept(tmp_path: Path) -> None:
    class Slow(Trajectory):
        def to_bytes(self) -> bytes:
            with Store(tmp_path) as other:
                other.add_run(sample_run(seconds=1.0), ID)
            return super().to_bytes()

    slow = Slow(**{**vars(sample_run()), "info": {**sample_run().info, "seconds": 2.0}})
    with Store(tmp_path) as store:
        assert store.add_run(slow, ID).seconds == 1.0
        assert len(store.rows()) == 1
    assert Trajectory.load(tmp_path / f"{ID}.npz").info["seconds"] == 1.0
    assert files(tmp_path) == {"runs.sqlite", f"{ID}.npz"}


def test_run_with_a_deleted_file_can_be_added_again(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        (tmp_path / store.add_run(sample_run(seconds=1.0), ID).path).unlink()
        assert store.find(ID) is None
        again = store.add_run(sample_run(seconds=2.0), ID)
        assert again.seconds == 2.0
        assert store.rows() == (again,)


def test_file_without_a_row_is_replaced(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        (tmp_path / f"{ID}.npz").write_bytes(b"left by a crash")
        assert store.find(ID) is None
        store.add_run(sample_run(), ID)
    assert Trajectory.load(tmp_path / f"{ID}.npz").status == "ok"


def test_interrupt_while_saving_leaves_neither_row_nor_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write_half(path: Path, data: bytes) -> NoReturn:
        with path.open("wb") as stream:
            stream.write(data[:100])
        raise KeyboardInterrupt

    with Store(tmp_path) as store:
        with monkeypatch.context() as patched:
            patched.setattr(Path, "write_bytes", write_half)
            with pytest.raises(KeyboardInterrupt):
                store.add_run(sample_run(), ID)
        assert store.rows() == ()
        assert files(tmp_path) == {"runs.sqlite"}
        store.add_run(sample_run(), ID)


def test_failure_while_inserting_leaves_no_row(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        with pytest.raises(StoreError):
            store.add_run(sample_run(seed=None), ID)
        assert store.rows() == ()
        assert store.find(ID) is None
        assert store.add_run(sample_run(), ID) == store.find(ID)


def test_rows_are_in_insertion_order(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        for run in (OTHER, ID):
            store.add_run(sample_run(), run)
        assert [row.id for row in store.rows()] == [OTHER, ID]


def test_nan_is_stored_as_null(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        row = store.add_run(sample_run(energy_end=float("nan"), energy_start=float("inf"), audited=False), ID)
        assert (row.energy_start, row.energy_end, row.missed_contacts) == (float("inf"), None, None)
        assert store.find(ID) == row


@pytest.mark.parametrize("run", ["", "../../../../tmp/ownage", "A" * 20, ID + "\n", ID[:19], "a/b"])
def test_invalid_id_is_rejected_and_creates_no_file(tmp_path: Path, run: str) -> None:
    with Store(tmp_path) as store:
        with pytest.raises(ValueError, match="not a run id"):
            store.add_run(sample_run(), run)
        assert store.find(run) is None
    assert files(tmp_path) == {"runs.sqlite"}


ADDER = """
import sys
from tests.batch.test_store import Store, sample_run
sys.stdin.read(1)
with Store(sys.argv[1]) as store:
    for run in sys.argv[2:]:
        store.add_run(sample_run(), run)
"""


@pytest.mark.fail_slow(60)  # takes over half a second
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
        store.add_run(sample_run(), ID)
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


def test_id_of_a_game_depends_on_the_rules_but_not_on_the_speed_of_the_window() -> None:
    texts = ("players = 1", "players = 1\nspeed = 0.5", "players = 2")
    scenes = [loads(f"{dumps(SCENE)}\n[play]\ngame = 'landing'\n{text}\n") for text in texts]
    same, slow, other = [
        run_id(scene, "pymunk", SCENE.solver, 7, VERSIONS, game={"name": "landing"}) for scene in scenes
    ]
    assert same == slow != other


def test_scene_hash_depends_on_the_scene_alone(tmp_path: Path) -> None:
    other = loads(dumps(SCENE), overrides=["world.duration=3.0"])
    with Store(tmp_path) as store:
        one = store.add_run(sample_run(), ID)
        same = store.add_run(sample_run(engine="box2d", seed=8), OTHER)
        third = store.add_run(
            replace(sample_run(), info={**sample_run().info, "scene": to_document(other)}), OTHER[::-1]
        )
    assert one.scene_hash == same.scene_hash != third.scene_hash


def add_with(store: Store, run: str, **values: Any) -> StoredRun:
    """Store a run with values that a command has set; two underscores stand for a dot."""
    set_values = {path.replace("__", "."): value for path, value in values.items()}
    return store.add(StoredRun.of(sample_run(), run, scene="x", values=set_values), None, values=set_values)


def cells(folder: Path, columns: str) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(folder / "runs.sqlite")) as database:
        return database.execute(f"SELECT {columns} FROM runs ORDER BY rowid").fetchall()


def test_each_value_that_is_set_has_a_column(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        add_with(store, ID, ball__a__mass=2.5, world__gravity=[0, -1], world__seed=3, title="other")
        add_with(store, OTHER, ball__a__fixed=True, ball__a__name="b")
    found = cells(tmp_path, '"ball.a.mass", "world.gravity", "ball.a.fixed", "ball.a.name"')
    assert found == [(2.5, "[0,-1]", None, None), (None, None, 1, "b")]
    columns = [row[1] for row in cells_of_table(tmp_path)][len(StoredRun.__dataclass_fields__) :]
    assert columns == ["ball.a.mass", "world.gravity", "ball.a.fixed", "ball.a.name"]  # seed and title have their own
    assert json.loads(cells(tmp_path, "set_values")[0][0]) == {
        "ball.a.mass": 2.5,
        "world.gravity": [0, -1],
        "world.seed": 3,
        "title": "other",
    }


def cells_of_table(folder: Path) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(folder / "runs.sqlite")) as database:
        return database.execute("PRAGMA table_info(runs)").fetchall()


def test_column_of_a_setting_has_the_setting_of_every_run(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        add_with(store, ID)
        add_with(store, OTHER, solver__dt=0.5)  # as swept; the stored settings have the scene's 0.01
        add_with(store, OTHER[::-1])
    assert cells(tmp_path, '"solver.dt"') == [(0.01,)] * 3


def test_spellings_of_a_path_share_a_column_and_names_in_sql_are_quoted(tmp_path: Path) -> None:
    notices: list[str] = []
    with Store(tmp_path, notices.append) as store:
        for run, path in ((ID, "ball[0].mass"), (OTHER, "ball.0.mass"), (OTHER[::-1], 'ball."a\'; DROP TABLE".mass')):
            values = {path: 2.0}
            store.add(StoredRun.of(sample_run(), run, values=values), None, values=values)
        assert not notices
        values = {"Ball.0.mass": 3.0}
        store.add(StoredRun.of(sample_run(), "f" * 20, values=values), None, values=values)
        assert "has no column beside ball.0.mass" in notices[0]  # SQL ignores case
        assert len(store.rows()) == 4
    assert cells(tmp_path, '"ball.0.mass"') == [(2.0,), (2.0,), (None,), (None,)]


def test_number_of_value_columns_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_VALUE_COLUMNS", 2)
    with Store(tmp_path) as store:
        add_with(store, ID, a__b=1, a__c=2)
        with pytest.raises(StoreError, match="more than 2 different values"):
            add_with(store, OTHER, a__d=3)
        assert [row.id for row in store.rows()] == [ID]
        add_with(store, OTHER, a__b=1)


def test_values_may_be_added_by_two_processes_in_turns(tmp_path: Path) -> None:
    with Store(tmp_path) as one, Store(tmp_path) as other:
        add_with(one, ID, a__b=1)
        add_with(other, OTHER, a__b=2)
        add_with(one, OTHER[::-1], a__b=3)
    assert cells(tmp_path, '"a.b"') == [(1,), (2,), (3,)]


def test_files_beyond_the_first_runs_are_in_subfolders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FLAT_RUNS", 2)
    runs = [f"{k:x}" * 20 for k in range(4)]
    with Store(tmp_path) as store:
        added = [store.add_run(sample_run(), run) for run in runs]
        assert [row.path for row in added] == [
            f"{runs[0]}.npz",
            f"{runs[1]}.npz",
            f"22/{runs[2]}.npz",
            f"33/{runs[3]}.npz",
        ]
    with Store(tmp_path) as store:
        assert store.rows() == tuple(added)
        for run in runs:
            found = store.find(run)
            assert found is not None and store.fault_of_file(found) is None
            file = store.file(found)
            assert file is not None and Trajectory.load(file).status == "ok"
        assert store.add_run(sample_run(), runs[0], replace_run=True).path == f"{runs[0]}.npz"  # stays where it was


def test_changed_file_is_noticed_without_reading_its_arrays(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        row = store.add_run(sample_run(), ID)
        assert store.fault_of_file(row) is None
        file = store.file(row)
        intact = file.read_bytes()
        for damaged in (intact[:-1], b"", intact + b"x", bytes([intact[0] ^ 1]) + intact[1:]):
            file.write_bytes(damaged)
            fault = store.fault_of_file(row)
            assert fault is not None and fault.startswith(f"{file} is not a stored run: ")


def test_run_without_arrays_is_found_and_has_no_file(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        row = add_with(store, ID)
        assert (row.path, row.size, store.file(row), store.fault_of_file(row)) == (None, None, None, None)
        assert store.find(ID) == row
    assert files(tmp_path) == {"runs.sqlite"}


def test_run_is_found_by_the_key_of_its_plan(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        row = store.add(StoredRun.of(sample_run(), ID, plan_key="a" * 20))
        assert store.find_planned("a" * 20) == row
        assert store.find_planned("b" * 20) is None
        store.set_plan_key(row, "b" * 20)
        assert store.find_planned("a" * 20) is None
        assert store.find_planned("b" * 20) is not None


def test_database_is_in_wal_mode(tmp_path: Path) -> None:
    with Store(tmp_path), closing(sqlite3.connect(tmp_path / "runs.sqlite")) as other:
        assert other.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert other.execute("SELECT count(*) FROM runs").fetchone() == (0,)  # while the store is open
