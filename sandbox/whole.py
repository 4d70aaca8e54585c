"""Whole files: read up to a limit; written under a temporary name, and renamed once they are complete.

A temporary name states the process that writes it. A process that is killed leaves its file behind; the next one
that writes to the folder removes it. The file of a process that is alive is never touched.
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
"""s without a write, after which a temporary file is stale whose process cannot be looked up: another host's."""

_searched: set[Path] = set()
"""Folders that this process has searched for stale files: once is enough, for a search reads the whole folder."""


def read_whole(path: Path, most: int) -> bytes:
    """Return the bytes of a file, which may be a pipe or a device without an end.

    Args:
        path: of the file.
        most: bytes that it may have.

    Raises:
        OSError: it cannot be read.
        ValueError: it is larger.
    """
    with path.open("rb") as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        raise ValueError(f"larger than {most >> 20} MiB")
    return content


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path to write to, which becomes the file at the end; after an error nothing is left of it.

    Raises:
        OSError: the file cannot take its place.
    """
    with temporary_in(path.parent) as temporary:
        yield temporary
        temporary.replace(path)


@contextmanager
def temporary_in(folder: Path) -> Iterator[Path]:
    """Yield a temporary path of a folder; a file that is still there at the end is removed."""
    temporary = temporary_path(folder)
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


def temporary_path(folder: Path) -> Path:
    """Return a temporary path of a folder, which no other has; stale files in the folder are removed first."""
    place = folder.absolute()
    if place not in _searched:
        _searched.add(place)
        remove_stale(folder)
    pid = os.getpid()
    _, start = _state_of(pid) or ("", 0)
    return folder / f".sandbox-{_host()}-{pid}-{start}-{uuid4().hex[:8]}.tmp"


def remove_stale(folder: Path) -> None:
    """Remove the temporary files of a folder whose processes are gone.

    Several processes may do so at the same time: a name is never used twice, so what is stale once stays so.
    """
    stale: list[Path] = []
    # What cannot be read or removed stays: whoever wants to write there gets the error of the write itself.
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
    if name["host"] == _host() and os.name != "nt":  # Windows has no harmless signal that asks for a process
        return not _is_alive(int(name["pid"]), int(name["start"]))
    return entry.stat(follow_symlinks=False).st_mtime < time() - MAX_AGE


def _is_alive(pid: int, start: int) -> bool:
    """Tell whether a process of this host runs; one that started at another time has only got its number."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another user's
        pass
    found = _state_of(pid)
    if found is None:
        return True
    state, now = found
    return state not in ("Z", "X") and start in (0, now)


def _state_of(pid: int) -> tuple[str, int] | None:
    """Return state and start, in ticks since the system's, of a process; None where there is no /proc that tells.

    Source: proc_pid_stat(5); the fields are counted from the end of the name, which may hold any character.
    """
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return fields[0].decode("ascii"), int(fields[19])


@cache
def _host() -> str:
    """Return 8 hex digits for the space in which process numbers are unique: a host since it started, or a container.

    Hosts that share a folder may have one name, and all have one number of their outermost space.
    """
    space = boot = ""
    with suppress(OSError):
        space = str(Path("/proc/self/ns/pid").readlink())
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    return hashlib.sha256(f"{platform.node()} {space} {boot}".encode()).hexdigest()[:8]
