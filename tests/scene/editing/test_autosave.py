"""Autosaves: unsaved text is written beside the scene file, and offered again after a crash of the editor."""

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.scene.editing import autosave as module
from sandbox.scene.editing.autosave import HEADER, INTERVAL, Autosave, recoverable
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import ElementKey, removal_changes
from sandbox.scene.files.load import loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.scene.files.toml_changes import SetValue

TEXT = """# a ball, by hand
[[ball]]
name = "a"
position = [0.0, 2.0]  # above
radius = 0.5
"""
DEAD_PID = 9_999_999_999


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "car.toml"
    path.write_text(TEXT)
    return path


def move(draft: SceneDraft, x: float) -> None:
    draft.change([SetValue(("ball", 0, "position", 0), x)], "move")


def edited(path: Path, x: float = 1.0, folder: Path | None = None) -> tuple[SceneDraft, Autosave]:
    """Return the draft of a scene with a change, and its autosave, which is not written yet."""
    draft = SceneDraft.read(path)
    autosave = Autosave(draft, folder)
    move(draft, x)
    return draft, autosave


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


def set_process(file: Path, pid: int) -> None:
    """Change the process in the header of an autosave."""
    line, _, text = file.read_bytes().decode().partition("\n")
    header = json.loads(line.removeprefix(HEADER)) | {"pid": pid, "start": 0}
    file.write_bytes(f"{HEADER}{json.dumps(header)}\n{text}".encode())


def left_behind(path: Path, x: float = 1.0, folder: Path | None = None) -> Path:
    """Write the autosave of an editor that has ended without saving; return its path."""
    _, autosave = edited(path, x, folder)
    before = names(folder or path.parent)
    assert autosave.update(0.0) is None
    autosave.release()
    (name,) = names(folder or path.parent) - before
    set_process((folder or path.parent) / name, DEAD_PID)
    return (folder or path.parent) / name


def test_unsaved_text_is_written_beside_the_file_and_removed_when_saved(path: Path) -> None:
    draft = SceneDraft.read(path)
    autosave = Autosave(draft)
    assert autosave.update(0.0) is None
    assert names(path.parent) == {"car.toml"}  # nothing is unsaved
    move(draft, 1.0)
    assert autosave.update(0.1) is None
    file = path.parent / ".car.toml.autosave"
    header, _, text = file.read_bytes().decode().partition("\n")
    assert text == draft.text
    assert header.startswith("#")
    assert str(path) in header
    assert str(os.getpid()) in header
    assert loads(file.read_text()) == draft.scene  # it can be opened as a scene, too
    assert path.read_text() == TEXT
    draft.save()
    autosave.update(0.2)
    assert names(path.parent) == {"car.toml"}


def test_writes_are_rare_and_only_after_changes(path: Path) -> None:
    (draft, autosave), file = edited(path), path.parent / ".car.toml.autosave"
    autosave.update(100.0)
    first = file.stat().st_ino
    move(draft, 2.0)
    autosave.update(100.0 + 0.9 * INTERVAL)
    assert file.stat().st_ino == first
    autosave.update(100.0 + 1.1 * INTERVAL)
    assert "2.0, 2.0" in file.read_text()
    second = file.stat().st_ino
    autosave.update(100.0 + 9.0 * INTERVAL)
    assert file.stat().st_ino == second


def test_autosave_ends_when_all_changes_are_undone_or_discarded(path: Path) -> None:
    draft, autosave = edited(path)
    autosave.update(0.0)
    draft.undo()
    autosave.update(0.1)
    assert names(path.parent) == {"car.toml"}
    draft.redo()
    autosave.update(2.0 * INTERVAL)
    assert ".car.toml.autosave" in names(path.parent)
    autosave.discard()
    assert names(path.parent) == {"car.toml"}


def test_saving_under_another_name_moves_the_autosave(path: Path) -> None:
    draft, autosave = edited(path)
    autosave.update(0.0)
    draft.save(path.parent / "other.toml")
    move(draft, 2.0)
    autosave.update(2.0 * INTERVAL)  # the first call after both
    assert names(path.parent) == {"car.toml", "other.toml", ".other.toml.autosave"}


def test_byte_order_mark_and_line_endings_are_recovered(path: Path) -> None:
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    left_behind(path)
    path = path.parent.rename(path.parent.parent / "moved") / path.name  # a moved folder takes its autosaves with it
    found = recoverable(path)
    assert not found.is_file_changed
    draft = SceneDraft.read(path)
    draft.replace_text(found.text, "restore")
    assert draft.text == TEXT.replace("\n", "\r\n").replace("0.0, 2.0", "1.0, 2.0")


EDITOR = """
import sys, time
from pathlib import Path
from sandbox.scene.editing.autosave import Autosave
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.files.toml_changes import SetValue

draft = SceneDraft.read(Path(sys.argv[1]))
autosave = Autosave(draft)
draft.change([SetValue(("ball", 0, "radius"), 0.25)], "resize")
print(autosave.update(time.monotonic()), flush=True)
time.sleep(60)
"""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.skipif(os.name == "nt", reason="Windows has no signal that tests for a process")
def test_changes_of_a_killed_editor_are_offered_and_those_of_a_living_one_are_not(path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", EDITOR, str(path)], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "None\n"
            assert ".car.toml.autosave" in names(path.parent)
            assert recoverable(path) is None  # it lives
            draft = SceneDraft.read(path)
            move(draft, 3.0)
            autosave = Autosave(draft)
            autosave.update(0.0)  # two editors of one file
            assert names(path.parent) == {"car.toml", ".car.toml.autosave", ".car.toml.2.autosave"}
            autosave.discard()
            process.send_signal(signal.SIGKILL)
            process.wait(10)
        finally:
            process.kill()
    found = recoverable(path)
    assert not found.is_file_changed
    draft = SceneDraft.read(path)
    draft.replace_text(found.text, "restore unsaved changes")
    assert draft.scene.balls[0].radius == 0.25
    assert draft.undo() == "restore unsaved changes"
    assert draft.text == TEXT


def test_restored_changes_keep_their_file_until_they_are_saved(path: Path) -> None:
    file = left_behind(path)
    found = recoverable(path)
    draft = SceneDraft.read(path)
    autosave = Autosave(draft)
    draft.replace_text(found.text, "restore")
    autosave.adopt(found)
    assert recoverable(path) is not None  # until the next write it is that of the dead process
    autosave.update(0.0)
    assert names(path.parent) == {"car.toml", file.name}
    assert recoverable(path) is None  # now it is ours
    draft.save()
    autosave.update(1.0)
    assert names(path.parent) == {"car.toml"}


def test_text_that_was_not_answered_is_never_overwritten(path: Path) -> None:
    file = left_behind(path)
    before = file.read_bytes()
    _, autosave = edited(path, x=5.0)
    autosave.update(0.0)
    assert file.read_bytes() == before
    assert names(path.parent) == {"car.toml", file.name, ".car.toml.2.autosave"}
    autosave.discard()
    assert names(path.parent) == {"car.toml", file.name}


def test_two_editors_that_restore_one_text_do_not_share_its_file(path: Path) -> None:
    left_behind(path)
    found = recoverable(path)
    one, other = SceneDraft.read(path), SceneDraft.read(path)
    saves = Autosave(one), Autosave(other)
    for draft, autosave in zip((one, other), saves, strict=True):
        draft.replace_text(found.text, "restore")
        autosave.adopt(found)
    move(one, 6.0)
    saves[0].update(0.0)
    set_process(found.autosave, os.getppid())  # as if of another process
    move(other, 7.0)
    saves[1].update(0.0)
    assert "6.0, 2.0" in found.autosave.read_text()
    assert "7.0, 2.0" in (path.parent / ".car.toml.2.autosave").read_text()
    saves[1].discard()
    assert names(path.parent) == {"car.toml", ".car.toml.autosave"}


def test_change_of_the_file_is_stated_and_an_autosave_with_its_text_is_removed(path: Path) -> None:
    file = left_behind(path)
    path.write_text("# newer\n" + TEXT)
    found = recoverable(path)
    assert found.is_file_changed
    path.write_text(file.read_text().partition("\n")[2])
    assert recoverable(path) is None
    assert names(path.parent) == {"car.toml"}


def test_discarded_text_is_not_offered_again_but_the_next_one_is(path: Path) -> None:
    left_behind(path, 1.0)
    left_behind(path, 2.0)
    for x in ("1.0", "2.0"):
        found = recoverable(path)
        assert f"{x}, 2.0" in found.text
        found.discard()
    assert recoverable(path) is None
    assert names(path.parent) == {"car.toml"}


def test_new_scene_is_kept_in_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    draft = SceneDraft()
    autosave = Autosave(draft)
    autosave.update(0.0)
    assert names(tmp_path) == set()
    draft.change(removal_changes(draft.scene, [ElementKey("plane", 0)]), "delete")
    autosave.update(0.0)
    assert names(tmp_path) == {".new-scene.toml.autosave"}
    assert recoverable(None) is None  # this editor is open
    autosave.release()
    found = recoverable(None)
    assert found.text == draft.text
    assert recoverable(tmp_path / "new-scene.toml") is None  # another scene


def test_shipped_scene_is_kept_in_the_given_folder(tmp_path: Path) -> None:
    path = find("tutorial/bounce")
    before = names(path.parent)
    file = left_behind(path, 0.125, tmp_path)
    assert names(path.parent) == before
    assert file.parent == tmp_path
    assert recoverable(path, tmp_path) is not None
    (tmp_path / "bounce.toml").write_text(path.read_text())
    assert recoverable(tmp_path / "bounce.toml") is None  # of the same name


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EROFS])
def test_failure_is_reported_once_and_the_file_stays(path: Path, monkeypatch: pytest.MonkeyPatch, error: int) -> None:
    def fail(self: Path, _data: bytes) -> int:
        raise OSError(error, os.strerror(error), str(self))

    (draft, autosave), file = edited(path), path.parent / ".car.toml.autosave"
    autosave.update(0.0)
    before = file.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", fail)
        move(draft, 2.0)
        assert os.strerror(error) in (autosave.update(1.0 * INTERVAL) or "")
        assert autosave.update(2.0 * INTERVAL) is None
        move(draft, 3.0)
        assert autosave.update(3.0 * INTERVAL) is None
    assert file.read_bytes() == before
    assert autosave.update(4.0 * INTERVAL) is None
    assert "3.0, 2.0" in file.read_text()  # written as soon as it is possible
    assert names(path.parent) == {"car.toml", file.name}


def test_folder_that_is_gone_is_reported(path: Path) -> None:
    _, autosave = edited(path)
    path.unlink()
    path.parent.rmdir()
    assert "cannot be kept" in (autosave.update(0.0) or "")
    autosave.release()
    autosave.discard()
    assert recoverable(path) is None


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe",
        HEADER.encode() + b"[]\n",
        HEADER.encode() + b'{"file": 1, "sha256": null, "host": "", "pid": 1, "start": 0}\n',
        HEADER.encode() + b'{"file": null, "sha256": null, "host": "", "pid": "1", "start": 0}\n',
        HEADER.encode() + b"[" * 100_000 + b"\n",
    ],
    ids=range(6),
)
def test_foreign_content_is_neither_offered_nor_touched(path: Path, content: bytes) -> None:
    file = path.parent / ".car.toml.autosave"
    file.write_bytes(content)
    os.utime(file, (0, 0))
    assert recoverable(path) is None
    _, autosave = edited(path)
    assert autosave.update(0.0) is None
    assert file.read_bytes() == content
    autosave.discard()
    assert names(path.parent) == {"car.toml", file.name}


def test_folders_and_pipes_of_that_name_are_left_alone(path: Path) -> None:
    (path.parent / ".car.toml.autosave").mkdir()
    if os.name == "posix":
        os.mkfifo(path.parent / ".car.toml.2.autosave")
        (path.parent / ".car.toml.3.autosave").symlink_to("nowhere")
    assert recoverable(path) is None
    before = names(path.parent)
    _, autosave = edited(path)
    assert autosave.update(0.0) is None
    autosave.discard()
    assert names(path.parent) == before


def test_full_set_of_names_is_reported(path: Path) -> None:
    for x in range(module.MAX_EDITORS):
        left_behind(path, 1.0 + x)
    draft = SceneDraft.read(path)
    move(draft, 0.5)
    assert f"there are {module.MAX_EDITORS} files" in (Autosave(draft).update(0.0) or "")


@pytest.mark.skipif(os.name != "posix", reason="needs permissions of files")
def test_autosave_of_a_private_file_is_private(path: Path) -> None:
    path.chmod(0o600)
    assert left_behind(path).stat().st_mode & 0o077 == 0
    draft = SceneDraft.read(path)
    move(draft, 1.0)
    Autosave(draft).update(0.0)
    assert (path.parent / ".car.toml.2.autosave").stat().st_mode & 0o077 == 0
