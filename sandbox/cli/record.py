"""Command `record`: play a game that uses pymunk, and keep the session as a recording."""

import contextlib
import os
import runpy
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sandbox.cli.common import collect_errors, exit_with_errors, reasons_not_writable
from sandbox.cli.options import json_option, pymunk6_option, quiet_option
from sandbox.cli.progress import progress_bars
from sandbox.cli.streams import print_json
from sandbox.echo import MAX_NAMED, shorten
from sandbox.formatting import format_plural
from sandbox.game_inputs import save_inputs
from sandbox.jsonable import to_json
from sandbox.recording import Recording, ReplayCheck
from sandbox.recording_remarks import remarks_on, replay_sentence
from sandbox.scene.errors import Fault

if TYPE_CHECKING:
    from sandbox.pymunk_capture.game_capture import GameCapture
    from sandbox.rehearsal.input_script import InputScript


OWN_OPTIONS = ("--to", "--force", "--script", "--steps", "--pymunk6", "--json", "--quiet")
"""Options of this command, which a game after whose name they stand gets instead"""


MAX_TITLE = 200
"""Characters of the title of a scene"""


@dataclass(frozen=True, kw_only=True)
class RecordDocument:
    """JSON document of a recorded game."""

    game: str
    """as the user named it"""
    recording: str | None = None
    """file that was written; None if there is none"""
    spaces: int = 0
    """spaces that made a step; the one with the most steps is recorded"""
    bodies: int = 0
    """at the start"""
    steps: int = 0
    duration: float = 0.0
    """s"""
    actions: int = 0
    omitted: Sequence[str] = ()
    """what the recording lacks"""
    inexact: Sequence[str] = ()
    """reasons for which a replay may differ by rounding"""
    replay: ReplayCheck | None = None
    """comparison of the replay with the game; None if there was none"""
    remarks: Sequence[str] = ()
    """what commands that take the recording repeat: what it lacks, and how far its replay departs from the game"""
    ended: str | None = None
    """why the game ended, if it did not end by itself"""


@click.command(name="record", context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})
@click.argument("game", metavar="GAME.py")
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="[ARGUMENTS]…")
@click.option("--to", "target", metavar="FILE", help="recording to write; default: GAME.json in the working folder")
@click.option("--force", is_flag=True, help="replace an existing file")
@click.option(
    "--script",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="play without a window, on a virtual clock, with the keys and the mouse of a script of inputs (TOML)",
)
@click.option("--steps", type=click.IntRange(min=1), metavar="N", help="end the game after so many steps of its space")
@pymunk6_option
@json_option
@quiet_option("print no summary; remarks are printed")
def record_command(
    game: str,
    arguments: tuple[str, ...],
    target: str | None,
    force: bool,
    script: Path | None,
    steps: int | None,
    pymunk6: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Play a game that uses pymunk, and keep the session as a recording.

    GAME.py runs as `python GAME.py [ARGUMENTS]` would run it, in this process; options of this command come before it.
    Its pymunk spaces are watched: the scene is the space before its first step, and what the game changes between two
    steps becomes an action. At the end the recording is replayed, and compared with the game. `sandbox replay`, `run`,
    `advise` and `export` take the recording; `check`, `compare` and `tradeoff` take its scene, without actions. What a
    scene cannot have, such as collision callbacks, is listed on standard error, and by these commands again. The
    recording also keeps what the program reads: events, keys, mouse, clock and random seeds. `sandbox rehearse GAME.py`
    and `sandbox advise GAME.py` run the game itself with them.
    """
    path = Path(target) if target is not None else Path(f"{Path(game).stem}.json")
    faults = _faults(game, path, force)
    played: InputScript | None = None
    with collect_errors(faults):
        played = None if script is None else _loaded(script)
    if faults:
        return exit_with_errors(faults, as_json, **to_json(RecordDocument(game=game)))
    from sandbox.pymunk_capture.game_capture import StepLimitReached, capture
    from sandbox.pymunk_capture.pymunk6 import pymunk6_names
    from sandbox.pymunk_capture.removed_names import removed_name
    from sandbox.pymunk_capture.space_capture import CaptureError

    misplaced = [each for each in arguments if each.partition("=")[0] in OWN_OPTIONS]
    if misplaced:
        click.echo(
            f"{game}: {', '.join(misplaced)}: passed to the game; options of this command come before GAME.py", err=True
        )
    from sandbox.rehearsal.surroundings import InputRecorder, started_as
    from sandbox.rehearsal.tape import EndOfTape

    ended: str | None = None
    removed: Fault | None = None  # a name that pymunk 7 lacks, where the game uses it
    status, is_whole = 0, False
    inputs = InputRecorder(game, arguments, played, pymunk6=pymunk6)
    names = pymunk6_names() if pymunk6 else contextlib.nullcontext()
    output = contextlib.redirect_stdout(sys.stderr) if as_json else contextlib.nullcontext()
    # Standard output is for the JSON document then.
    with names, capture(max_steps=steps) as captured, inputs.recording(), started_as(game, arguments), output:
        try:
            runpy.run_path(game, run_name="__main__")
            is_whole = True
        except StepLimitReached:
            pass
        except SystemExit as end:
            is_whole = not isinstance(end, EndOfTape)  # the usual end of a game
        except KeyboardInterrupt:
            ended, status = "interrupted", 130
        except Exception as error:  # noqa: BLE001, of the user's program
            traceback.print_exc()
            removed = removed_name(error, game)
            ended, status = f"{type(error).__name__}: {error}" if removed is None else str(removed), 1
    if not captured.steps and removed is not None:
        faults = [removed]
    elif not captured.steps:
        faults = [Fault.of(game, "no pymunk space made a step, so that there is nothing to record")]
    recording: Recording | None = None
    known = inputs.inputs(is_whole=is_whole)
    if not faults:
        try:
            # before the replay, which may take as long as the game
            replace(captured.recording, inputs=known).save(path)
            recording = _with_title(_checked(captured, as_json or quiet), Path(game).stem)
            recording = replace(recording, inputs=known)
            recording.save(path)
        except CaptureError as error:
            save_inputs(known, path)
            fault = f"its space cannot be a scene: {error}; {path} has its inputs, for `rehearse` and `advise {game}`"
            faults = [Fault.of(game, fault)]
        except OSError as error:
            faults = [Fault.of(str(path), f"cannot be written: {error.strerror or error}")]
    if recording is None or faults:
        return exit_with_errors(faults, as_json, **to_json(RecordDocument(game=game, ended=ended)))
    check = None if recording.game is None else recording.game.replay
    document = RecordDocument(
        game=game,
        recording=str(path),
        spaces=len(captured.spaces),
        bodies=len(recording.scene.bodies),
        steps=captured.steps,
        duration=recording.duration,
        actions=len(recording.actions),
        omitted=captured.omitted,
        inexact=captured.inexact,
        replay=check,
        remarks=(*remarks_on(recording), *(f"left out of the inputs: {each}" for each in known.notes)),
        ended=ended,
    )
    if as_json:
        print_json(to_json(document))
    elif not quiet:
        bodies = f"{document.bodies:,} {'body' if document.bodies == 1 else 'bodies'}"
        steps_made = f"{format_plural(document.steps, 'step')} of {1000.0 * recording.settings.dt:.4g} ms"
        if not captured.has_constant_step:
            steps_made += " (median)"
        summary = f"{bodies}, {steps_made}, {format_plural(document.actions, 'action')}"
        click.echo(f"written: {shorten(str(path), MAX_NAMED)} ({summary})")
        if check is not None and check.is_equal:
            click.echo(replay_sentence(recording.scene, check))
    for each in document.remarks:
        click.echo(f"{game}: {each}", err=True)
    if removed is not None:
        click.echo(str(removed), err=True)
    return status


def _checked(captured: "GameCapture", is_silent: bool) -> Recording:
    """Return the recording with the check of its replay; without it if Ctrl-C ends the replay.

    Raises:
        CaptureError: the space cannot be a scene.
    """
    from sandbox.measure.run.replay_check import checked_recording

    try:
        with progress_bars(is_silent) as bars:
            return checked_recording(captured, bars.callback("replaying the recording"))
    except KeyboardInterrupt:
        click.echo("interrupted: the recording is kept, and its replay was not compared with the game", err=True)
        return captured.recording


def _with_title(recording: Recording, title: str) -> Recording:
    """Return a recording whose scene has a title of at most the length of titles; unchanged if it cannot be printed."""
    if not title.isprintable():
        return recording
    return replace(recording, scene=recording.scene.model_copy(update={"title": title[:MAX_TITLE]}))


def _faults(game: str, path: Path, force: bool) -> list[Fault]:
    """Return why the game cannot be run, or the recording cannot be written."""
    found = []
    try:
        exists = Path(game).exists()
    except OSError as error:  # the name is too long for the file system
        return [Fault(shorten(game, MAX_NAMED), None, "", f"cannot be read: {error.strerror or error}")]
    if not exists:
        found.append(Fault.of(game, "does not exist; name the Python file of the game"))
    elif Path(game).suffix != ".py" and not (Path(game) / "__main__.py").exists():
        found.append(Fault.of(game, "is no Python program; name a .py file, or a folder with a __main__.py"))
    reason = next(iter(reasons_not_writable(path)), "")
    if not reason and path.exists() and not force:
        reason = "exists already; add --force to replace it, or name another file: --to FILE"
    if reason:
        found.append(Fault.of("--to", f"{shorten(str(path), MAX_NAMED)}: {reason}"))
    return found


def _loaded(script: Path) -> "InputScript":
    """Read a script of inputs; the program shows no window then.

    Raises:
        SceneError: it cannot be read, or has faults.
    """
    os.environ |= {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy", "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
    from sandbox.rehearsal.input_script import load_script

    return load_script(script)
