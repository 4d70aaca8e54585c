"""Autosave: the unsaved text of a draft, in a file beside its scene file, and its recovery after a crash.

The file of `car.toml` is `.car.toml.autosave`; while another editor uses that name, `.car.toml.2.autosave`. Its first
line is a comment that states scene file, SHA-256 of the file when it was read, and process. The file of a living
process, and one whose text was neither restored nor discarded yet, is never overwritten. Scenes without a file, and
shipped scenes, which are not changed, have theirs in the working folder.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from stat import S_ISREG
from time import time

from sandbox.atomic_write import MAX_AGE, atomic_write, host_name, is_process_alive, process_state
from sandbox.scene.editing.draft import BYTE_ORDER_MARK, SceneDraft
from sandbox.scene.files import shipped_scenes
from sandbox.scene.files.load import too_large

INTERVAL = 3.0
"""s between two writes, at least"""
MAX_EDITORS = 9
"""Autosaves of one scene file"""
NEW_SCENE_NAME = "new-scene.toml"
"""Name that stands for a scene without a file"""
HEADER = "# sandbox autosave "

_in_use: set[Path] = set()
"""Autosaves that belong to an editor of this process"""


@dataclass(frozen=True)
class AutosaveHeader:
    """First line of an autosave: which scene file it belongs to, and which process wrote it."""

    file: str | None
    """absolute path of the scene file; None for a scene without a file"""
    sha256: str | None
    """of the scene file when it was read or saved"""
    host: str
    pid: int
    start: int
    """of the process, in ticks since the start of the system; 0 if unknown"""

    @classmethod
    def of(cls, draft: SceneDraft) -> "AutosaveHeader":
        """Return the header of a draft of this process."""
        saved, pid = draft.saved_text, os.getpid()
        _, start = process_state(pid) or ("", 0)
        file = None if draft.path is None else str(draft.path.absolute())
        return cls(file, None if saved is None else _sha256(saved.encode("utf-8")), host_name(), pid, start)

    @classmethod
    def read(cls, line: str) -> "AutosaveHeader | None":
        """Read the first line of a file; None if it is not that of an autosave."""
        if not line.startswith(HEADER):
            return None
        try:
            found = cls(**json.loads(line.removeprefix(HEADER)))
        except (TypeError, ValueError, RecursionError):
            return None
        is_valid = all(isinstance(each, str | None) for each in (found.file, found.sha256))
        is_valid &= isinstance(found.host, str) and all(isinstance(each, int) for each in (found.pid, found.start))
        return found if is_valid else None

    @property
    def line(self) -> str:
        """The header as a comment of TOML; JSON escapes line breaks."""
        return f"{HEADER}{json.dumps(asdict(self))}\n"

    @property
    def is_of_this_process(self) -> bool:
        """Whether this process has written the file."""
        return self.host == host_name() and self.pid == os.getpid() and is_process_alive(self.pid, self.start)

    def is_of(self, path: Path | None) -> bool:
        """Return whether the autosave belongs to a scene file, whose folder may have been moved."""
        if path is None or self.file is None:
            return path is None and self.file is None
        return Path(self.file).name == path.name and _is_shipped(Path(self.file)) == _is_shipped(path)


@dataclass(frozen=True)
class RecoveredText:
    """Unsaved text of an editor that has ended."""

    text: str
    written_at: float
    """s since 1970"""
    is_file_changed: bool
    """whether the scene file has changed since that editor read it"""
    autosave: Path
    """file that holds the text"""

    def discard(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            self.autosave.unlink()


class Autosave:
    """Writes the unsaved text of a draft beside its file.

    Args:
        draft: the draft; the name of the autosave follows its path.
        folder: for scenes that have no file, and for shipped ones; by default the working folder.
    """

    def __init__(self, draft: SceneDraft, folder: Path | None = None) -> None:
        self._draft, self._folder = draft, folder
        self._file: Path | None = None  # that this editor has written
        self._written: tuple[str, Path | None] | None = None  # text and path of the draft as last written
        self._tried_at = -INTERVAL
        self._failure: str | None = None

    def update(self, now: float) -> str | None:
        """Write the draft if it has changed, or remove the file if nothing is unsaved; called every frame.

        Args:
            now: a monotonic time, s.

        Returns:
            The message of a failure when it first occurs; editing can continue.
        """
        if not self._draft.is_changed:
            self.discard()
            return None
        state = self._draft.text, self._draft.path
        if state == self._written or now - self._tried_at < INTERVAL:
            return None
        self._tried_at, before = now, self._failure
        self._failure = self._write()
        if self._failure is None:
            self._written = state
        return self._failure if self._failure != before else None

    def adopt(self, recovered: RecoveredText) -> None:
        """Use the file of a text that was restored; it is overwritten, or removed when nothing is unsaved."""
        self._use(recovered.autosave)

    def discard(self) -> None:
        """Remove the file."""
        file = self._file
        self._use(None)
        self._written = self._failure = None
        if file is not None and _is_free(file, is_own=True):
            with suppress(OSError):
                file.unlink()

    def release(self) -> None:
        """End without losing anything: unsaved text is written, and offered to the next editor of the scene."""
        self._tried_at = -INTERVAL
        self.update(0.0)
        self._use(None)

    def _write(self) -> str | None:
        """Write the draft; return why that failed, or None."""
        draft = self._draft
        names = list(_autosaves_of(draft.path, self._folder))
        file = self._file if self._file in names else None
        if file is None or not _is_free(file, is_own=True):  # another editor may have restored it at the same time
            file = next((each for each in names if _is_free(each)), None)
        if file is None:
            return f"unsaved changes cannot be kept: there are {MAX_EDITORS} files such as {names[0]} already"
        try:
            with atomic_write(file) as temporary:
                mode = 0o600 if draft.path is None or not draft.path.exists() else draft.path.stat().st_mode & 0o777
                temporary.touch(mode)  # a private scene has a private autosave
                temporary.write_bytes(f"{AutosaveHeader.of(draft).line}{draft.text}".encode())
        except OSError as error:
            return f"unsaved changes cannot be kept in {file.parent}: {error.strerror or error}"
        former = self._file
        self._use(file)
        if former is not None and former != file and _is_free(former, is_own=True):  # saved under another name
            with suppress(OSError):
                former.unlink()
        return None

    def _use(self, file: Path | None) -> None:
        if self._file is not None:
            _in_use.discard(self._file)
        if file is not None:
            _in_use.add(file)
        self._file = file


def recoverable(path: Path | None, folder: Path | None = None) -> RecoveredText | None:
    """Return unsaved text of a scene file that an editor has left behind which no longer runs.

    An autosave whose text is that of the file is removed.

    Args:
        path: of the scene file; None for a new scene.
        folder: for scenes that have no file, and for shipped ones; by default the working folder.
    """
    present: bytes | None = None
    if path is not None:
        with suppress(OSError):
            present = path.read_bytes()
    for file in _autosaves_of(path, folder):
        found = _read(file)
        if found is None or not found[0].is_of(path) or _is_live(file, found[0]):
            continue
        header, text, written_at = found
        recovered = RecoveredText(text, written_at, present is not None and _sha256(present) != header.sha256, file)
        if present is None or present.removeprefix(BYTE_ORDER_MARK.encode()) != text.encode():
            return recovered
        recovered.discard()
    return None


def _autosaves_of(path: Path | None, folder: Path | None) -> Iterator[Path]:
    """Yield the names that autosaves of a scene file may have, the preferred one first."""
    if path is None or _is_shipped(path):
        parent, name = (folder or Path()).absolute(), NEW_SCENE_NAME if path is None else path.name
    else:
        parent, name = path.absolute().parent, path.name
    for k in range(1, MAX_EDITORS + 1):
        yield parent / (f".{name}.autosave" if k == 1 else f".{name}.{k}.autosave")


def _is_shipped(path: Path) -> bool:
    root = shipped_scenes.folder()
    return root is not None and path.absolute().is_relative_to(root)


def _read(file: Path) -> tuple[AutosaveHeader, str, float] | None:
    """Return header, text and time of an autosave, s since 1970; None if it cannot be read, or is none."""
    try:
        status = file.stat()
        if not S_ISREG(status.st_mode) or too_large(status.st_size) is not None:
            return None
        line, _, text = file.read_bytes().decode("utf-8").partition("\n")
    except (OSError, UnicodeDecodeError):
        return None
    header = AutosaveHeader.read(line)
    return None if header is None else (header, text, status.st_mtime)


def _is_live(file: Path, header: AutosaveHeader) -> bool:
    """Return whether the editor that has written an autosave still runs; see `atomic_write.remove_stale`."""
    if header.is_of_this_process:
        return file in _in_use
    if header.host == host_name() and os.name != "nt":  # Windows has no signal that tests for a process
        return is_process_alive(header.pid, header.start)
    try:
        return file.stat().st_mtime >= time() - MAX_AGE
    except OSError:
        return False


def _is_free(file: Path, is_own: bool = False) -> bool:
    """Return whether an editor may write to a name.

    Args:
        file: the name.
        is_own: whether the file was written or restored by this editor.
    """
    if not os.path.lexists(file):
        return True
    found = _read(file) if is_own else None
    return found is not None and (found[0].is_of_this_process or not _is_live(file, found[0]))


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
