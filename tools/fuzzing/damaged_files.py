"""Damaged files of every kind that the program reads, passed to every command that reads them.

A case passes if each command ends with status 0, 1 or 2, without a traceback, and with a message of bounded length on
standard error unless the status is 0, and if `run --out`, which repeats a damaged run, leaves a valid store.
"""

import atexit
import contextlib
import io
import json
import os
import random
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from sandbox.action import Impulse, Spawn
from sandbox.cli.main import call
from sandbox.games.high_scores import opened
from sandbox.jsonable import to_json
from sandbox.measure.extremes.baseline import StoredError, changes, read
from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.recording import Recording
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tools.fuzzing.file_damage import (
    Damage,
    apply_damage,
    draw_archive,
    draw_bytes,
    draw_database,
    draw_json,
    draw_text,
)
from tools.fuzzing.isolated import Case, Violation

MAX_ERROR = 20_000  # characters on standard error
MAX_LINE = 2_000  # characters of one line on standard error

SCENE = """
title = "Drop"
[world]
gravity = [0.0, -10.0]
duration = 0.3
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[zone]]
position = [0.5, 0.5]
radius = 0.3
to_layer = "up"
[[sensor]]
body = "a"
points = [[0.0, -0.5], [0.0, 0.5]]
thickness = 0.2
[[ball]]
name = "a"
position = [0.0, 0.6]
radius = 0.5
restitution = 0.5
[[ball]]
name = "b"
position = [3.0, 1.0]
radius = 0.5
[[joint]]
kind = "rod"
between = ["a", "b"]
"""

GAME = """
title = "Pad"
[world]
gravity = [0.0, -1.6]
duration = 0.4
[[plane]]
name = "pad"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[box]]
name = "ship"
position = [0.0, 5.0]
size = [1.0, 1.0]
[[thrust]]
name = "main"
body = "ship"
force = [0.0, 5.0]
key = "up"
[play]
game = "landing"
"""

SCRIPT = "0.1, main, 1  # up\n0.2, main, 0.5\n0.3, main, 0\n"

LIMITS = {
    "tolerance": 0.01,
    "versions": {"python": "3"},
    "limits": [
        {"axis": "dt", "engine": "pymunk", "settings": {}, "setup": "pymunk", "limit": 0.02, "first_failure": 0.03},
        {
            "axis": "x",
            "engine": "pymunk",
            "settings": {},
            "setup": "pymunk",
            "limit": 5,
            "first_failure": None,
            "bounds": [4.5, None],
        },
    ],
}


@dataclass(frozen=True)
class Kind:
    """A kind of file."""

    path: str
    """path in the folder of a case; a pattern for a stored run, whose name is its id"""
    commands: tuple[str, ...]
    """keys of `COMMANDS` of the commands that read it"""
    draw: Callable[[Path, random.Random], Damage]


def _draw_run(path: Path, draw: random.Random) -> Damage:
    if draw.random() < 0.3:
        return draw_bytes(draw)
    with np.load(path) as arrays:
        shapes = {name: arrays[name].shape for name in arrays.files}
        return draw_archive(shapes, json.loads(str(arrays["info"])), draw)


def _draw_document(path: Path, draw: random.Random) -> Damage:
    if draw.random() < 0.3:
        return draw_text(draw)
    return draw_json(json.loads(path.read_text(encoding="utf-8")), draw)


def _draw_text(_: Path, draw: random.Random) -> Damage:
    return draw_text(draw)


def _draw_store(_: Path, draw: random.Random) -> Damage:
    return draw_database(draw)


RUN = ("run", "plot", "csv", "contacts", "png", "gif", "replay", "again", "other")
SESSION = ("run", "csv", "png", "replay", "again", "other", "check")
KINDS = {
    "run": Kind("runs/*.npz", RUN, _draw_run),
    "game": Kind("games/*.npz", RUN, _draw_run),
    "store": Kind("runs/runs.sqlite", ("run", "other run"), _draw_store),
    "session": Kind("session.json", SESSION, _draw_document),
    "game session": Kind("game.json", SESSION, _draw_document),
    "scene": Kind("drop.toml", ("run", "check", "play", "scene replay"), _draw_text),
    "script": Kind("script.txt", ("run",), _draw_text),
    "boundaries": Kind("extremes.json", ("changes", "against"), _draw_document),
    "scores": Kind("high-scores.json", ("scores",), _draw_document),
}
WEIGHTS = {"run": 8, "game": 4, "store": 3, "session": 3, "game session": 2, "scene": 2, "script": 1, "boundaries": 1,
           "scores": 1}  # fmt: skip


# --- drawing cases --------------------------------------------------------------------------------------------------


def file_cases(seed: int, count: int, first: int = 0) -> Iterator[Case]:
    """Yield the cases of the damaged files `first` to `first + count − 1` of a seed."""
    for index in range(first, first + count):
        drawn = argument(seed, index)
        yield Case("tools.fuzzing.damaged_files:read_damaged", drawn, f"damaged {drawn['file']} {index} of seed {seed}")


def argument(seed: int, index: int) -> dict[str, Any]:
    """Return the argument of `read_damaged` for one damaged file."""
    draw = random.Random(f"{seed}:{index}")
    name = draw.choices(list(WEIGHTS), list(WEIGHTS.values()))[0]
    kind = KINDS[name]
    (path,) = _base().glob(kind.path)
    if draw.random() < 0.02:
        damage = [draw.choice(({"op": "folder"}, {"op": "cut", "at": 0.0, "length": 10**9}))]
    else:
        damage = [kind.draw(path, draw) for _ in range(draw.choice((1, 1, 1, 2)))]
    commands = draw.sample(kind.commands, min(len(kind.commands), draw.choice((1, 2, 3))))
    return {"file": name, "damage": damage, "commands": commands}


# --- running cases --------------------------------------------------------------------------------------------------


def read_damaged(argument: Mapping[str, Any]) -> str | None:
    """Damage a file and run commands that read it.

    Args:
        argument: `file`, a key of `KINDS`; `damage`, a list of damages for `apply_damage`; `commands`, keys of
            `COMMANDS`.

    Returns:
        None if all commands ended with status 0, else the worst status, such as `status 2`.

    Raises:
        Violation: a command violated a check.
    """
    kind = KINDS[argument["file"]]
    statuses = []
    for command in argument["commands"]:
        with tempfile.TemporaryDirectory(prefix="damaged-") as name:
            folder = Path(name)
            shutil.copytree(_base(), folder, dirs_exist_ok=True)
            (path,) = folder.glob(kind.path)
            apply_damage(path, argument["damage"])
            with contextlib.chdir(folder):
                statuses.append(COMMANDS[command](argument["file"], str(path.relative_to(folder))))
    worst = max(statuses)
    return f"status {worst}" if worst else None


def _call(*arguments: str) -> tuple[int, str]:
    """Call a command; return its status and standard output.

    Raises:
        Violation: the command did not answer as it should.
    """
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = call(list(arguments))
    errors, words = err.getvalue(), " ".join(arguments)
    if status not in (0, 1, 2):
        raise Violation("status", f"{status} of `sandbox {words}`")
    if status and not errors.strip():
        raise Violation("silence", f"status {status} of `sandbox {words}`, and no message")
    if "Traceback" in errors:
        raise Violation("traceback on standard error", errors[-2000:])
    if len(errors) > MAX_ERROR or max(map(len, errors.splitlines()), default=0) > MAX_LINE:
        raise Violation("length", f"{len(errors):,} characters of `sandbox {words}`: {errors[:1000]}")
    out.getvalue().encode("utf-8")  # raises for lone surrogates
    errors.encode("utf-8")
    return status, out.getvalue()


def _run(file: str, path: str, *more: str) -> int:
    """Run the command of the file; check that stored runs are valid and are found by the next call."""
    if file in ("session", "game session"):
        return _call("run", path, "--json")[0]
    if file == "script":
        return _call("run", "game.toml", "--player", path, "--json")[0]
    if file == "scene":
        return _call("run", path, "--json", "--no-audit")[0]
    words = ["run", *(("game.toml", "--player", "random") if file == "game" else ("drop.toml", "--ledger"))]
    words += ["--out", str(Path(path).parent), "--json", *more]
    status, out = _call(*words)
    if status == 2:
        return status
    (row,) = json.loads(out)["runs"]
    if Trajectory.load(row["path"]).info.get("state_hash") != row["state_hash"]:
        raise Violation("store", "the stored run is another than the one that was made")
    again, out = _call(*words)
    (found,) = json.loads(out)["runs"]
    if again != status or not found["repeated"]:
        raise Violation("store", "the run that was made again is not found")
    return status


def _plot(file: str, path: str) -> int:
    return _run(file, path, "--plot", "run.png")


def _other_run(_: str, path: str) -> int:
    """Run a run that is not in the store yet."""
    return _call("run", "drop.toml", "--set", "world.seed=5", "--out", str(Path(path).parent), "--json")[0]


def _export(*words: str) -> Callable[[str, str], int]:
    return lambda _, path: _call("export", path, *words)[0]


def _windowed(*words: str) -> Callable[[str, str], int]:
    """Return a command that opens a window without a display and closes it after a few frames."""

    def run(_: str, path: str) -> int:
        from sandbox.window.app import App

        def few_frames(window: App) -> int:
            for elapsed in (0.0, 0.05, 1.0):
                window.run_frame(elapsed)
            return window.context.exit_status or 0

        with mock.patch.object(App, "run", few_frames), mock.patch.dict(os.environ, DUMMY):
            return _call(words[0], path, *words[1:])[0]

    return run


DUMMY = {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy", "PYGAME_HIDE_SUPPORT_PROMPT": "1"}


def _changes(_: str, path: str) -> int:
    """Compare stored boundaries with given ones, without measuring."""
    try:
        before = read(path)
    except StoredError as error:
        if len(str(error)) > MAX_LINE:
            raise Violation("length", str(error)[:1000]) from None
        return 2
    now = [
        Boundary("dt", "pymunk", {}, "pymunk", 0.01, 0.02, "why"),
        Boundary("x", "pymunk", {}, "pymunk", None, 5.0, ""),
    ]
    for change in changes(before, now):
        json.dumps(to_json(change), allow_nan=False)
        str(change).encode()
    return 0


def _against(_: str, path: str) -> int:
    """Call `extremes --against` with an unknown axis, so that nothing is measured and both faults are reported."""
    return _call("extremes", "--axes", "none", "--against", path)[0]


def _scores(_: str, path: str) -> int:
    """Read high scores and enter one."""
    try:
        scores = opened(Path(path).absolute())
    except OSError:
        return 2  # the path is a folder, which the window reports
    scores.enter("landing: Pad", "abc", 10)
    if scores.notice is not None and len(scores.notice) > MAX_LINE:
        raise Violation("length", scores.notice[:1000])
    if opened(Path(path).absolute()).notice is not None:
        raise Violation("scores", "the file is damaged again")
    return 0 if scores.notice is None else 1


COMMANDS: dict[str, Callable[[str, str], int]] = {
    "run": _run,
    "other run": _other_run,
    "plot": _plot,
    "csv": _export("--to", "a.csv"),
    "contacts": _export("--contacts", "--to", "a.csv"),
    "png": _export("--to", "a.png", "--width", "320", "--overlay", "contacts"),
    "gif": _export("--to", "a.gif", "--width", "160", "--fps", "5"),
    "replay": _windowed("replay"),
    "again": _windowed("replay", "--engine", "pymunk"),
    "other": _windowed("replay", "--engine", "reference"),
    "play": _windowed("play"),
    "scene replay": _windowed("replay"),
    "check": lambda _, path: _call("check", path)[0],
    "changes": _changes,
    "against": _against,
    "scores": _scores,
}


@cache
def _base() -> Path:
    """Make a folder with one valid file of each kind for this process; it is copied for each case."""
    folder = Path(tempfile.mkdtemp(prefix="valid-"))
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # and not a process forked from this one
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    (folder / "drop.toml").write_text(SCENE, encoding="utf-8")
    (folder / "game.toml").write_text(GAME, encoding="utf-8")
    (folder / "script.txt").write_text(SCRIPT, encoding="utf-8")
    (folder / "extremes.json").write_text(json.dumps(LIMITS), encoding="utf-8")
    opened(folder / "high-scores.json").enter("landing: Pad", "abc", 7)
    scene = loads(SCENE)
    ball = Ball(name="c", position=(9.0, 9.0), radius=1.0)
    actions = (Spawn(time=0.1, ball=ball), Impulse(time=0.2, body="c", impulse=(1.0, 0.0)))
    session = Recording(scene, "pymunk", scene.solver, actions, 0.3)
    Recording(scene, "pymunk", scene.solver, actions, 0.3, rerun(session).info["state_hash"]).save(
        folder / "session.json"
    )
    play_out(loads(GAME), "random").recording.save(folder / "game.json")
    with contextlib.chdir(folder):
        for words in (
            ("drop.toml", "--ledger", "--out", "runs"),
            ("game.toml", "--player", "random", "--out", "games"),
        ):
            _call("run", *words, "--json")
    return folder
