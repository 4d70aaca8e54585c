"""Recorded sessions as arguments of commands: their remarks, and their scenes."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import click

from sandbox.cli.common import scene_path, scene_paths
from sandbox.formatting import format_plural
from sandbox.measure.run.sessions import read_session, recorded_scene
from sandbox.recording import Recording
from sandbox.recording_remarks import remarks_on
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_session, load

MAX_REMARKS = 8
"""Remarks on a recording that are printed; JSON documents have all."""


class ReadScene(NamedTuple):
    """Scene that a command was given, or the scene of a recording."""

    path: str
    """its file"""
    scene: Scene
    remarks: tuple[str, ...]
    """of a recording; empty for a scene"""


def is_recording(path: str) -> bool:
    """Return whether a file is a recorded session, by its name."""
    return path.lower().endswith(".json")


def read_scene(name: str, overrides: Iterable[Override] = ()) -> ReadScene:
    """Read a scene, or the scene of a recording with the settings and the duration of the recording.

    Args:
        name: of a scene file, a shipped scene or a recorded session.
        overrides: values that are set first.

    Raises:
        SceneError: it is not found, or has faults.
    """
    path = scene_paths([name])[0][1]
    if not is_recording(path):
        return ReadScene(path, load(scene_path(name), overrides), ())
    recording = read_session(path)
    scene = recorded_scene(recording)
    overrides = tuple(overrides)
    if overrides:
        scene = from_session(to_document(scene), path, overrides)
    return ReadScene(path, scene, (*remarks_on(recording), *_without_actions(recording)))


def _without_actions(recording: Recording) -> tuple[str, ...]:
    """Return the remark that a command takes the scene alone."""
    count = len(recording.actions)
    if not count:
        return ()
    actions = format_plural(count, "action")
    return (f"the scene of the recording is taken, without its {actions}; `sandbox run` applies them",)


def report_remarks(name: str, remarks: Sequence[str]) -> None:
    """Print the remarks on a recording on standard error, one per line, up to `MAX_REMARKS`.

    The last ones say how far the replay departs and which command runs the game itself, and are always printed.

    Args:
        name: the recording as the user named it.
        remarks: the remarks.
    """
    left_out = len(remarks) - MAX_REMARKS
    for remark in remarks[: MAX_REMARKS - 2] if left_out > 0 else remarks:
        click.echo(f"{name}: {remark}", err=True)
    if left_out > 0:
        click.echo(f"{name}: … and {left_out:,} more remarks, which are in the file", err=True)
        for remark in remarks[-2:]:
            click.echo(f"{name}: {remark}", err=True)
