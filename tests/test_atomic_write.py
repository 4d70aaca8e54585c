"""Atomic writes: temporary files of dead processes are removed by the next write in that folder, and no others."""

import os
import subprocess
import sys
from pathlib import Path
from time import time

import pytest

from sandbox import atomic_write as module
from sandbox.atomic_write import TEMPORARY, atomic_write, remove_stale, temporary_path

HALF = """
import sys
from pathlib import Path
from sandbox.atomic_write import atomic_write
with atomic_write(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    print("ready", flush=True)
    sys.stdin.read()
"""
WHOLE = """
import sys
from pathlib import Path
from sandbox.atomic_write import atomic_write
with atomic_write(Path(sys.argv[1])) as temporary:
    temporary.write_text("whole")
"""
DAYS = 3 * 86_400.0


def writing(path: Path) -> subprocess.Popen[str]:
    """Start a process that stops in the middle of writing a file."""
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", HALF, str(path)], stdin=pipe, stdout=pipe, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    return process


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_next_write_removes_temporary_files_of_killed_processes_only(tmp_path: Path) -> None:
    with writing(tmp_path / "a") as killed, writing(tmp_path / "b") as alive:
        killed.kill()
        killed.wait()
        assert len(names(tmp_path)) == 2
        subprocess.run([sys.executable, "-c", WHOLE, str(tmp_path / "c")], check=True)
        left = names(tmp_path) - {"c"}
        assert len(left) == 1
        assert f"-{alive.pid}-" in left.pop()
        alive.communicate("")
    assert names(tmp_path) == {"b", "c"}


@pytest.mark.parametrize("stopped", [True, False])
def test_temporary_file_of_a_zombie_is_stale_but_not_of_a_stopped_process(tmp_path: Path, stopped: bool) -> None:
    import signal

    with writing(tmp_path / "a") as process:
        process.send_signal(signal.SIGSTOP if stopped else signal.SIGKILL)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
        remove_stale(tmp_path)
        assert len(names(tmp_path)) == stopped
        process.kill()


def with_part(path: Path, part: str, value: str) -> Path:
    """Return a temporary path with another host, process or start."""
    match = TEMPORARY.fullmatch(path.name)
    start, end = match.span(part)
    return path.with_name(path.name[:start] + value + path.name[end:])


def test_temporary_file_with_another_start_time_of_the_same_pid_is_stale(tmp_path: Path) -> None:
    own = temporary_path(tmp_path)
    own.write_text("mine")
    with_part(own, "start", "1").write_text("of an earlier process")
    with_part(own, "pid", "9999999999").write_text("of an impossible process")
    remove_stale(tmp_path)
    assert names(tmp_path) == {own.name}


def test_temporary_file_of_another_host_is_stale_after_a_day(tmp_path: Path) -> None:
    fresh, old = (with_part(temporary_path(tmp_path), "host", "0" * 8) for _ in range(2))
    fresh.write_text("")
    old.write_text("")
    os.utime(old, (time() - DAYS, time() - DAYS))
    remove_stale(tmp_path)
    assert names(tmp_path) == {fresh.name}


def test_stale_file_removed_by_another_process_does_not_stop_the_cleanup(tmp_path, monkeypatch):
    for _ in range(3):
        old = with_part(temporary_path(tmp_path), "host", "0" * 8)
        old.write_text("")
        os.utime(old, (0, 0))
    is_stale, checked = module._is_stale, list[str]()

    def remove_first_then_check(entry: "os.DirEntry[str]") -> bool:
        if not checked:
            Path(entry.path).unlink()
        checked.append(entry.name)
        return is_stale(entry)

    monkeypatch.setattr(module, "_is_stale", remove_first_then_check)
    remove_stale(tmp_path)
    assert len(checked) == 3
    assert names(tmp_path) == set()


def test_folders_links_and_files_with_other_names_are_kept(tmp_path: Path) -> None:
    dead = with_part(temporary_path(tmp_path), "pid", "9999999999")
    dead.mkdir()
    others = {".sandbox-notes.tmp", ".0123456789abcdef.tmp", f"a{dead.name}", f"{dead.name}.tmp"}
    for name in others:
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (0, 0))
    with_part(dead, "start", "2").symlink_to(tmp_path / ".sandbox-notes.tmp")
    remove_stale(tmp_path)
    assert names(tmp_path) == others | {dead.name, with_part(dead, "start", "2").name}


def test_write_into_a_missing_folder_raises(tmp_path: Path) -> None:
    remove_stale(tmp_path / "none")
    with pytest.raises(FileNotFoundError), atomic_write(tmp_path / "none" / "a") as temporary:
        temporary.write_text("")
