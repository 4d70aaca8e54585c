"""Atomic writing of files: under a temporary name, which is renamed when the file is complete.

A temporary name states the process that writes it. A process that is killed leaves its file behind; the next process
that writes to the folder removes it. The file of a living process is never touched.
"""

import hashlib
import os
import platform
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from time import time
from uuid import uuid4

TEMPORARY = re.compile(r"\.sandbox-(?P<host>[0-9a-f]{8})-(?P<pid>\d{1,10})-(?P<start>\d{1,20})-[0-9a-f]{8}\.tmp")
"""A temporary name: host, process, when the process started, and a random part."""
MAX_AGE = 86_400.0
"""s without a write, after which a temporary file of another host, whose processes cannot be looked up, is stale."""

_searched: set[Path] = set()
"""Folders that this process has searched for stale files; a search reads the whole folder, so it is made once."""


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path to write to, which is renamed to `path` at the end, or removed after an error.

    Raises:
        OSError: the file cannot be renamed.
    """
    with temporary_in(path.parent) as temporary:
        yield temporary
        temporary.replace(path)


@contextmanager
def temporary_in(folder: Path) -> Iterator[Path]:
    """Yield a temporary path in a folder; a file that still exists under it at the end is removed."""
    temporary = temporary_path(folder)
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


def temporary_path(folder: Path) -> Path:
    """Return a unique temporary path in a folder; stale files in the folder are removed first."""
    absolute = folder.absolute()
    if absolute not in _searched:
        _searched.add(absolute)
        remove_stale(folder)
    pid = os.getpid()
    _, start = process_state(pid) or ("", 0)
    return folder / f".sandbox-{host_name()}-{pid}-{start}-{uuid4().hex[:8]}.tmp"


def remove_stale(folder: Path) -> None:
    """Remove the temporary files of a folder whose processes have ended.

    Several processes may do so at the same time: a name is never used twice, so a stale file stays stale.
    """
    stale: list[Path] = []
    # Files that cannot be read or removed stay; writing to such a folder raises an error of its own.
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError):  # another process may have removed it
                stale += [Path(entry.path)] if _is_stale(entry) else []
    for path in stale:
        with suppress(OSError):
            path.unlink()


def _is_stale(entry: os.DirEntry[str]) -> bool:
    name = TEMPORARY.fullmatch(entry.name)
    if name is None or not entry.is_file(follow_symlinks=False):
        return False
    if name["host"] == host_name() and os.name != "nt":  # Windows has no signal that tests for a process
        return not is_process_alive(int(name["pid"]), int(name["start"]))
    return entry.stat(follow_symlinks=False).st_mtime < time() - MAX_AGE


def is_process_alive(pid: int, start: int) -> bool:
    """Return whether a process of this host runs; a process that started at another time has only the same number."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another user's
        pass
    found = process_state(pid)
    if found is None:
        return True
    state, now = found
    return state not in ("Z", "X") and start in (0, now)


def process_state(pid: int) -> tuple[str, int] | None:
    """Return state and start of a process, in ticks since the start of the system; None without /proc.

    Source: proc_pid_stat(5); the fields are counted from the end of the name, which may contain any character.
    """
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return fields[0].decode("ascii"), int(fields[19])


@cache
def host_name() -> str:
    """Return 8 hex digits for the PID namespace: a host since it started, or a container.

    Hosts that share a folder may have one name, and their outermost namespaces have one number.
    """
    space = boot = ""
    with suppress(OSError):
        space = str(Path("/proc/self/ns/pid").readlink())
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    return hashlib.sha256(f"{platform.node()} {space} {boot}".encode()).hexdigest()[:8]
