"""Stored runs as a user names them: a file, an id in its folder, or a folder that holds one run."""

from pathlib import Path

import numpy as np

from sandbox.recording import Recording
from sandbox.scene.faults import Fault, SceneError
from sandbox.trajectory import Trajectory

MOST_NAMED = 3
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
        raise SceneError([Fault(text, None, "", f"cannot be read: {reason}")]) from None
    message = "no such run; `sandbox run SCENE --out DIR` stores one as DIR/<id>.npz"
    raise SceneError([Fault(text, None, "", message)])


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
            return Recording.load(path)
        if path.suffix.lower() == ".toml":
            raise ValueError(f"is a scene; `sandbox play {name}` plays it, `sandbox run {name} --out DIR` stores a run")
        if not begins.startswith(b"PK"):
            raise ValueError("neither a stored run (.npz) nor a recording (.json)")
        run = Trajectory.load(path)
        _check(run)
    except OSError as error:
        raise SceneError([Fault(name, None, "", f"cannot be read: {error.strerror or error}")]) from None
    except ValueError as error:
        raise SceneError([Fault(name, None, "", str(error).removeprefix(f"{path} "))]) from None
    return run


def _only_run(folder: Path, text: str) -> Path:
    runs = sorted(path for path in folder.glob("*.npz") if not path.name.startswith("."))
    if len(runs) == 1:
        return runs[0]
    if not runs:
        message = "holds no run; `sandbox run SCENE --out DIR` stores one"
        raise SceneError([Fault(text, None, "", message)])
    some = ", ".join(str(folder / run.stem) for run in runs[:MOST_NAMED])
    if len(runs) > MOST_NAMED:
        from sandbox.batch.store import DATABASE  # 8 ms of sqlite3, for this message alone

        some += f" … the table `runs` of {folder / DATABASE} lists all {len(runs):,} with scene, engine and settings"
    raise SceneError([Fault(text, None, "", f"holds {len(runs):,} runs; name one, such as {some}")])


def _check(run: Trajectory) -> None:
    """Make sure that a run's arrays belong together; any program may have written the file.

    Raises:
        ValueError: they do not.
    """
    if np.ndim(run.time) != 1 or np.ndim(run.names) != 1 or np.ndim(run.contact_time) != 1:
        raise ValueError("is no stored run: its time, names and contact_time are no rows of values")
    frames, bodies, contacts = len(run.time), len(run.names), len(run.contact_time)
    shapes: dict[str, tuple[int, ...]] = {"time": (frames,), "retired_time": (bodies,), "contact_time": (contacts,)}
    shapes |= dict.fromkeys(("position", "velocity"), (frames, bodies, 2))
    shapes |= dict.fromkeys(("angle", "angular_velocity"), (frames, bodies))
    shapes |= dict.fromkeys(("contact_pair", "contact_point", "contact_normal", "contact_impulse"), (contacts, 2))
    shapes |= {"broken_time": (np.size(run.broken_time),)}
    shapes |= {"missed_time": np.shape(run.missed_time)[:1], "missed_pair": (*np.shape(run.missed_time)[:1], 2)}
    for name, shape in shapes.items():
        array = getattr(run, name)
        kind = np.int64 if name.endswith("_pair") else np.float64
        if np.shape(array) != shape or array.dtype != kind:
            found = " x ".join(map(str, np.shape(array)))
            raise ValueError(f"is no stored run: {name} is {found} of {array.dtype}, not {' x '.join(map(str, shape))}")
    if run.layer.size and (run.layer.shape != (frames, bodies) or run.layer.dtype.kind != "i"):
        raise ValueError("is no stored run: layer is no row of whole numbers for each frame")
    if run.names.dtype.kind != "U" or not (np.diff(run.time) >= 0.0).all():
        raise ValueError("is no stored run: its names are no text, or its times do not rise")
    info = {"engine": str, "status": str}
    for key, kind_of in info.items():
        if not isinstance(run.info.get(key), kind_of):
            raise ValueError(f"is no stored run: its info does not say `{key}`")
    if "reason" not in run.info:
        raise ValueError("is no stored run: its info does not say `reason`")
