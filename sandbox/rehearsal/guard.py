"""Guard of a rehearsal: the game writes to copies of its files, makes no connections and starts no programs.

The guard is an audit hook of the interpreter. It keeps a game from doing harm by accident; it is no protection from a
program that means harm, which has the rights of the user.
"""

import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any
from unittest.mock import patch

from sandbox.rehearsal.game_clock import PACKAGES, is_own_code

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_PATHS = {
    "os.remove": (0,),
    "os.rename": (0, 1),
    "os.rmdir": (0,),
    "os.mkdir": (0,),
    "os.truncate": (0,),
    "os.link": (1,),
    "os.symlink": (1,),
    "os.chmod": (0,),
    "os.chown": (0,),
    "os.utime": (0,),
    "shutil.rmtree": (0,),
    "shutil.copyfile": (1,),
    "shutil.move": (0, 1),
    "sqlite3.connect": (0,),
}
"""Arguments that are paths which an event of the interpreter changes"""
THREADS = "threads"
_REMARKS = {
    **dict.fromkeys(("socket.connect", "socket.bind", "socket.sendto"), "connections to a network"),
    **dict.fromkeys(
        ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.startfile", "os.fork"),
        "other programs that it starts",
    ),
}
"""Remark on each event of the interpreter that a rehearsal cannot repeat"""


class FileWatch:
    """Notes which files a program reads and writes, and whether it connects to a network or starts programs.

    An audit hook cannot be removed; `stop` ends its work.

    Args:
        note: called with a remark on what a rehearsal cannot repeat.
        on_read: called with the path of each file that is opened to read.
        on_write: called with the path of each file that is about to be changed.
    """

    def __init__(
        self,
        note: Callable[[str], None],
        on_read: Callable[[Path], None] = lambda _: None,
        on_write: Callable[[Path], None] = lambda _: None,
    ) -> None:
        self._note, self._on_read, self._on_write = note, on_read, on_write
        self._is_active = self._is_busy = False

    def start(self) -> None:
        """Begin."""
        self._is_active = True
        sys.addaudithook(self._hook)

    def stop(self) -> None:
        """End."""
        self._is_active = False

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._is_active or self._is_busy:
            return
        self._is_busy = True  # the functions below open files too
        try:
            self._watch(event, arguments)
        finally:
            self._is_busy = False

    def _watch(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            name, mode, flags = arguments
            if not isinstance(name, (str, bytes, os.PathLike)):
                return
            path = Path(os.fsdecode(name))
            is_written = bool(flags & WRITING) if isinstance(flags, int) else bool(set(mode or "") & set("wax+"))
            (self._on_write if is_written else self._on_read)(path)
        elif event in _PATHS:
            for index in _PATHS[event]:
                if isinstance(arguments[index], (str, bytes, os.PathLike)):
                    self._on_write(Path(os.fsdecode(arguments[index])))
        elif event in _REMARKS and not _is_by_package():
            self._note(_REMARKS[event])


@contextmanager
def threads_noted(note: Callable[[str], None]) -> Iterator[None]:
    """Note threads that a program starts, within a `with` block: not all versions of the interpreter audit them.

    Args:
        note: called with the remark.
    """
    start = threading.Thread.start

    def started(self: threading.Thread) -> None:
        if not _is_by_package():
            note(THREADS)
        start(self)

    with patch.object(threading.Thread, "start", started):
        yield


def _is_by_package() -> bool:
    """Return whether a package that the game uses does it, and not the game, such as pygame in search of fonts."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and (is_own_code(frame.f_code.co_filename)):
        frame = frame.f_back
    return frame is None or any(name in frame.f_code.co_filename for name in PACKAGES)


class DeniedError(PermissionError):
    """Something that a game may not do in a rehearsal."""


def deny_changes(scratch: Path, kept: Sequence[Path], note: Callable[[str], None]) -> None:
    """Let the rest of this process change no files but temporary ones, make no connections and start no programs.

    Args:
        scratch: folder in which everything is allowed.
        kept: folders of the game, whose files are not changed, wherever they are.
        note: called with a remark on each thing that is denied.
    """
    temporary = scratch, Path(tempfile.gettempdir()), Path(os.devnull).parent

    def is_within(path: Path, folders: Iterable[Path]) -> bool:
        return any(path.is_relative_to(folder.resolve()) for folder in folders)

    def check(path: Path) -> None:
        resolved = path.resolve()
        if is_within(resolved, (scratch,)) or (is_within(resolved, temporary) and not is_within(resolved, kept)):
            return
        note(f"changes of {path}, which is not among the files that the recording has")
        raise DeniedError(f"{path}: a rehearsal does not change the files of the game")

    def refuse(remark: str) -> None:
        note(remark)
        raise DeniedError(f"a rehearsal has no {remark}")

    FileWatch(refuse, on_write=check).start()


def mirror_folders(folders: Sequence[Path], saved: Mapping[Path, bytes | None], target: Path) -> dict[Path, Path]:
    """Make folders of links in which a program can write: the files that it writes are copies, all others are links.

    Args:
        folders: absolute paths of the folders of the program, such as its own and its working folder.
        saved: content of each file that the program writes, by absolute path; None if the file does not exist.
        target: empty folder in which the mirrors are made.

    Returns:
        The mirror of each folder.
    """
    outermost = [each for each in folders if not any(other != each and each.is_relative_to(other) for other in folders)]
    mirrors: dict[Path, Path] = {}
    for number, folder in enumerate(dict.fromkeys(outermost)):
        root = target / str(number)
        needed = {path: content for path, content in saved.items() if path.is_relative_to(folder)}
        _mirror(folder, root, needed, [each for each in folders if each.is_relative_to(folder)])
        mirrors |= {each: root / each.relative_to(folder) for each in folders if each.is_relative_to(folder)}
    return mirrors


def _mirror(folder: Path, target: Path, saved: Mapping[Path, bytes | None], own: Sequence[Path]) -> None:
    """Mirror a folder; folders within it are links unless the program has its own files in them."""
    target.mkdir(parents=True)
    for path, content in saved.items():
        if path.parent == folder and content is not None:
            (target / path.name).write_bytes(content)
    for each in os.scandir(folder):
        path = Path(each.path)
        if path in saved:
            continue
        if each.is_dir() and any(inner.is_relative_to(path) for inner in (*saved, *own)):
            _mirror(path, target / each.name, saved, own)
        else:
            (target / each.name).symlink_to(path)
