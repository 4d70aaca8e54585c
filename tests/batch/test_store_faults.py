"""Faults of a store: damaged databases, locks held by other processes, leftover files, full disks."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from sandbox.batch import store as module
from sandbox.batch.store import DATABASE, VERSION, Store, StoreError
from sandbox.batch.stored_run import TABLE
from sandbox.signals import defer_interrupt
from tests.batch.test_store import ID, OTHER, files, sample_run
from tests.environment import with_root_on_path

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SAVING = """
import sys
from pathlib import Path
from sandbox.atomic_write import temporary_in
with temporary_in(Path(sys.argv[1])) as staged:  # as `Store.add` does
    staged.write_bytes(b"half")
    print("ready", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """A folder with one run."""
    with Store(tmp_path) as store:
        store.add_run(sample_run(), ID)
    return tmp_path


def change(folder: Path, *statements: str) -> None:
    with closing(sqlite3.connect(folder / DATABASE, isolation_level=None)) as database:
        for statement in statements:
            database.execute(statement)


@contextmanager
def saving(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a process that blocks while it saves a run."""
    pipe = subprocess.PIPE
    script = [sys.executable, "-c", SAVING, str(folder)]
    with subprocess.Popen(script, env=with_root_on_path(), stdin=pipe, stdout=pipe, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def test_opening_removes_files_of_killed_processes_and_not_of_live_ones(filled: Path) -> None:
    complete = files(filled)
    with saving(filled) as process:
        assert len(files(filled) - complete) == 1
        Store(filled).close()
        assert len(files(filled) - complete) == 1
        process.kill()
        process.wait()
        Store(filled).close()
    assert files(filled) == complete


DAMAGED = {
    "a path outside": "path = '../outside.npz'", "another run's path": f"path = '{OTHER}.npz'",
    "a path of bytes": "path = x'00ff'", "text that is not UTF-8": "scene_title = CAST(x'ff80' AS TEXT)",
    "text for a number": "steps = 'many'", "a fraction for a count": "contacts = 0.5",
    "an unknown status": "status = 'fine'", "settings that are no JSON": "settings = '{'",
    "settings that are nested deeply": f"settings = '{'[' * 100_000}'",
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGED.values(), ids=DAMAGED)
def test_damaged_row_is_reported_and_its_run_can_be_added_again(filled: Path, damage: str) -> None:
    change(filled, f"UPDATE runs SET {damage}")
    notices: list[str] = []
    with Store(filled, notices.append) as store:
        assert store.find(ID) is None
        assert store.find(ID) is None
        assert len(notices) == 1
        assert f"{DATABASE}: a damaged row" in notices[0]
        assert len(notices[0]) < len(str(filled)) + 200
        assert store.rows() == ()
        added = store.add_run(sample_run(seconds=2.0), ID)
        assert store.find(ID) == added
        assert store.rows() == (added,)


def test_row_without_a_required_value_is_damaged(filled: Path) -> None:
    nullable = TABLE.replace(" NOT NULL", "")
    with closing(sqlite3.connect(filled / DATABASE, isolation_level=None)) as database:
        database.execute("PRAGMA writable_schema = ON")
        database.execute("UPDATE sqlite_master SET sql = ? WHERE name = 'runs'", (nullable.strip(),))
    change(filled, "UPDATE runs SET status = NULL")
    with closing(sqlite3.connect(filled / DATABASE, isolation_level=None)) as database:
        database.execute("PRAGMA writable_schema = ON")
        database.execute("UPDATE sqlite_master SET sql = ? WHERE name = 'runs'", (TABLE.strip(),))
    with Store(filled) as store:
        assert store.find(ID) is None


LAYOUTS = {
    "no table": ["DROP TABLE runs"],
    "a missing column": ["ALTER TABLE runs DROP COLUMN reason"],
    "a column more": ["ALTER TABLE runs ADD COLUMN more TEXT"],
    "a column of a value with a type": ['ALTER TABLE runs ADD COLUMN "solver.dt" REAL'],
    "a view in place of the table": ["ALTER TABLE runs RENAME TO others", "CREATE VIEW runs AS SELECT * FROM others"],
    "a trigger": ["CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END"],
    "no version": ["PRAGMA user_version = 0"],
}


@pytest.mark.parametrize("statements", LAYOUTS.values(), ids=LAYOUTS)
def test_database_with_a_different_layout_is_rejected_and_unchanged(filled: Path, statements: list[str]) -> None:
    change(filled, *statements)
    before = (filled / DATABASE).read_bytes()
    with pytest.raises(StoreError, match=r"runs\.sqlite: "):
        Store(filled)
    assert (filled / DATABASE).read_bytes() == before


@pytest.mark.parametrize("version", [1, VERSION - 1])
def test_store_of_an_earlier_version_is_refused_and_unchanged(filled: Path, version: int) -> None:
    change(filled, f"PRAGMA user_version = {version}")
    before = (filled / DATABASE).read_bytes()
    with pytest.raises(StoreError, match=rf"earlier version of sandbox \(format {version};"):
        Store(filled)
    assert (filled / DATABASE).read_bytes() == before


def test_any_damage_of_the_database_raises_store_error(filled: Path) -> None:
    with Store(filled) as store:
        for k in range(30):
            store.add_run(sample_run(scene={"title": "μ" * 50}), f"{k:020x}")
    intact = (filled / DATABASE).read_bytes()
    rng = random.Random(3)
    for k in range(150):
        damaged = bytearray(intact)
        if k % 3 == 0:
            damaged = damaged[: rng.randrange(len(damaged))]
        else:
            start = rng.choice([0, 100, rng.randrange(len(damaged))])
            for at in range(start, min(start + rng.choice([1, 16, 400]), len(damaged))):
                damaged[at] = rng.randrange(256)
        (filled / DATABASE).write_bytes(damaged)
        try:
            with Store(filled) as store:
                store.rows()
                store.find(ID)
                store.add_run(sample_run(), ID)
        except StoreError as error:
            assert DATABASE in str(error)


def test_run_is_replaced_with_its_row(filled: Path) -> None:
    with Store(filled) as store:
        assert store.add_run(sample_run(seconds=9.0), ID).seconds == 0.25
        assert store.add_run(sample_run(seconds=9.0), ID, replace_run=True).seconds == 9.0
        assert [row.seconds for row in store.rows()] == [9.0]
    assert files(filled) == {DATABASE, f"{ID}.npz"}


@pytest.fixture
def locked(filled: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A store that a second connection has locked, with short waiting times."""
    monkeypatch.setattr(module, "NOTICE", 0.01)
    monkeypatch.setattr(module, "WAIT", 0.1)
    with closing(sqlite3.connect(filled / DATABASE, isolation_level=None)) as database:
        database.execute("BEGIN EXCLUSIVE")
        yield filled


def test_locked_store_raises_after_a_wait_with_one_notice(locked: Path) -> None:
    notices: list[str] = []
    with pytest.raises(StoreError, match="another process has locked it"):
        Store(locked, notices.append)
    assert len(notices) == 1
    assert "waiting" in notices[0]


def test_interrupt_ends_the_wait_for_a_lock_even_if_deferred(locked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WAIT", 600.0)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may start the tests with SIGINT ignored
    try:
        with pytest.raises(KeyboardInterrupt), defer_interrupt():
            Store(locked, lambda _: os.kill(os.getpid(), signal.SIGINT))
    finally:
        signal.signal(signal.SIGINT, before)


def test_store_opens_if_its_lock_is_released_in_time(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "NOTICE", 0.01)
    with closing(sqlite3.connect(filled / DATABASE, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        with Store(filled, lambda _: other.execute("ROLLBACK") and None) as store:
            assert store.find(ID) is not None


def test_folder_removed_while_open_raises_store_error(filled: Path) -> None:
    with Store(filled) as store:
        for path in filled.iterdir():
            path.unlink()
        filled.rmdir()
        with pytest.raises(StoreError, match=str(filled)):
            store.add_run(sample_run(), OTHER)
    filled.mkdir()


def test_full_disk_keeps_stored_runs_and_leaves_no_partial_files(filled: Path) -> None:
    script = f"""
import resource, sys
from tests.batch.test_store import Store, StoreError, sample_run
import numpy as np
from dataclasses import replace
store = Store(sys.argv[1])
long = replace(sample_run(), time=np.random.default_rng(0).random(100_000))
for limit in (0, 100, 4096, 100_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        store.add_run(long, "{OTHER}")
    except StoreError as error:
        print(error)
"""
    process = subprocess.run(
        [sys.executable, "-c", script, str(filled)],
        env=with_root_on_path(),
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert process.stderr == ""
    messages = process.stdout.splitlines()
    assert len(messages) == 4
    assert all(line.endswith("free some disk space, or name another folder") for line in messages)
    assert files(filled) == {DATABASE, f"{ID}.npz"}
    with Store(filled) as store:
        assert store.find(ID) is not None
