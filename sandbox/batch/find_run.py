"""Stored runs as a user names them: a file, an id in its folder, or a folder that holds one run."""

from pathlib import Path

from sandbox.measure.run.sessions import read_session
from sandbox.recording import Recording
from sandbox.scene.errors import Fault, SceneError
from sandbox.trajectory import Trajectory

MAX_NAMED_RUNS = 3
"""Ids that one message lists."""


def find_run(text: str) -> Path:
    """Return the file of a run or recording.

    Args:
        text: `DIR/<id>.npz`, `DIR/<id>`, a recording's `.json`, or `DIR` where it holds exactly one run.

    Raises:
        SceneError: there is no such run, or several.
    """
    try:
        path = Path(text)
        if path.is_dir():
            return _only_run(path, text)
        if path.is_file():
            return path
        stored = Path(f"{text}.npz")
        if stored.is_file():
            return stored
    except (OSError, ValueError) as error:  # such as a name longer than any file's
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault.of(text, f"cannot be read: {reason}")]) from None
    message = "no such run; `sandbox run SCENE --out DIR` stores runs as DIR/ID.npz"
    raise SceneError([Fault.of(text, message)])


def read_run(path: Path, name: str) -> Trajectory | Recording:
    """Return a stored run, or the recording of a session.

    Args:
        path: its file.
        name: how the user called it.

    Raises:
        SceneError: the file is neither, or damaged.
    """
    try:
        with path.open("rb") as stream:
            begins = stream.read(4096).lstrip()
        if begins.startswith(b"{"):
            return read_session(path)
        if path.suffix.lower() == ".toml":
            raise ValueError(
                f"is a scene, not a run; use `sandbox play {name}`, or store a run with `sandbox run {name} --out DIR`"
            )
        if not begins.startswith(b"PK"):
            raise ValueError("is neither a stored run (.npz) nor a recorded session (.json)")
        return Trajectory.load(path)
    except OSError as error:
        raise SceneError([Fault.of(name, f"cannot be read: {error.strerror or error}")]) from None
    except ValueError as error:
        raise SceneError([Fault.of(name, str(error).removeprefix(f"{path}").lstrip(": "))]) from None


def _only_run(folder: Path, text: str) -> Path:
    runs = sorted(path for path in folder.glob("*.npz") if not path.name.startswith("."))
    if len(runs) == 1:
        return runs[0]
    if not runs:
        message = "contains no run; `sandbox run SCENE --out DIR` stores runs"
        raise SceneError([Fault.of(text, message)])
    some = ", ".join(str(folder / run.stem) for run in runs[:MAX_NAMED_RUNS])
    if len(runs) > MAX_NAMED_RUNS:
        from sandbox.batch.store import DATABASE  # 8 ms of sqlite3, for this message alone

        some += f" …; the table `runs` of {folder / DATABASE} lists all with scene, engine and settings"
    raise SceneError([Fault.of(text, f"contains {len(runs):,} runs; name one: {some}")])
