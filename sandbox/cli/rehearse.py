"""Command `rehearse`: run a recorded pymunk game again, with its inputs and other settings of the physics."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from sandbox.cli.common import collect_errors, exit_with_errors, reasons_not_writable
from sandbox.cli.options import POSITIVE, OutputOptions, json_option, quiet_option, takes
from sandbox.cli.progress import status_line
from sandbox.cli.streams import print_json
from sandbox.cli.tables import print_item, print_line
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.formatting import format_number, format_plural
from sandbox.game_inputs import GameInputs, file_digest, load_inputs
from sandbox.jsonable import in_json, to_json
from sandbox.measure.game_advice.difference import CallbackDifference, GameTruth, contacts, difference_from
from sandbox.measure.game_advice.repeatability import first_mismatch, likely_causes
from sandbox.progress import Progress
from sandbox.rehearsal.rehearse import (
    DEFAULT_MEMORY_LIMIT,
    DEFAULT_TIME_LIMIT,
    Rehearsal,
    RehearsalError,
    first_difference,
    rehearse,
)
from sandbox.rehearsal.step_settings import RehearsalSettings
from sandbox.scene.errors import Fault, SceneError

INDENT = "   "
SINGULAR = {"bodies": "body", "joints": "joint"}
MAX_OUTPUT_LINES = 10
"""Lines of what the game prints that are shown; the JSON document has all that is kept"""


@dataclass(frozen=True, kw_only=True)
class CallbackCount:
    """Calls of a collision callback."""

    callback: str
    """as the game registers it"""
    contacts: int
    """contacts for which it is called"""
    calls: int


@dataclass(frozen=True, kw_only=True)
class CallbackEntry:
    """Calls of a callback in one frame."""

    frame: int
    callback: str
    bodies: Sequence[str]
    """names of the two bodies"""
    calls: int


@dataclass(frozen=True, kw_only=True)
class FromOwn:
    """Difference from the run with the settings of the game."""

    error: float
    """largest distance of a body, in units of the game"""
    body: str | None
    """that body"""
    frame: int | None
    """frame in which it is there"""
    callbacks: Sequence[CallbackDifference]
    """contacts that are missed, late or extra, seen from the game's own setting"""


@dataclass(frozen=True, kw_only=True)
class RehearsalDocument:
    """JSON document of a rehearsal."""

    game: str
    """as the user named it"""
    inputs: str | None = None
    """file of the inputs"""
    settings: Mapping[str, float] = field(default_factory=dict)
    """settings that replace those of the game"""
    frames: int = 0
    duration: float = 0.0
    """s, of the recorded session"""
    steps: int = 0
    """calls of `Space.step` by the game"""
    bodies: int = 0
    """largest number of bodies in a frame"""
    is_repeatable: bool | None = None
    """whether a second run is equal, bit for bit; None if the first one failed"""
    equals_recording: bool | None = None
    """whether the states of the bodies after each frame are those of the recorded game; None with other settings"""
    first_difference: str | None = None
    """first difference of two runs, or from the recorded game; None if there is none"""
    causes: Sequence[str] = ()
    """likely causes of a difference"""
    callbacks: Sequence[CallbackCount] = ()
    calls: Sequence[CallbackEntry] = ()
    added: Mapping[str, int] = field(default_factory=dict)
    """bodies and joints that the game adds after its first step"""
    removed: Mapping[str, int] = field(default_factory=dict)
    from_own: FromOwn | None = field(default=None, metadata=in_json(optional=True))
    """difference from the settings of the game; only with others"""
    frame_hashes: Sequence[str] = ()
    """hash of the states of all bodies after each frame"""
    output: str = ""
    """what the game printed"""
    ended: str | None = None
    """`program`: by itself; `inputs`: the recorded inputs had ended; `error`: it failed"""
    failure: str | None = None
    """exception that ended it"""
    remarks: Sequence[str] = ()
    """what the game did that a rehearsal does not have, and files that have changed since the recording"""


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    game: str
    inputs: str | None
    substeps: int | None
    iterations: int | None
    dt: float | None
    overrides: tuple[str, ...]
    states: Path | None
    time_limit: float
    memory_limit: int


@click.command(name="rehearse")
@click.argument("game", metavar="GAME.py")
@click.option("--inputs", metavar="FILE", help="recording with the inputs; default: GAME.json in the working folder")
@click.option("--substeps", type=click.IntRange(min=1), metavar="N", help="cut each step of the game into N")
@click.option("--iterations", type=click.IntRange(min=1), metavar="N", help="set the iterations of all spaces")
@click.option("--dt", type=POSITIVE, metavar="S", help="cut each step of the game into equal ones of at most S seconds")
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="set slop, bias or persistence of all spaces, or joint_bias, the error_bias of all joints",
)
@click.option("--states", type=click.Path(path_type=Path), metavar="FILE.npz", help="write the states of all bodies")
@click.option(
    "--time-limit", type=POSITIVE, default=DEFAULT_TIME_LIMIT, metavar="S", help="time of a run, s; default: 300"
)
@click.option(
    "--memory-limit",
    type=click.IntRange(min=64),
    default=DEFAULT_MEMORY_LIMIT,
    metavar="MIB",
    help="address space of a run; default: 4096",
)
@json_option
@quiet_option()
@takes(_Options)
def rehearse_command(options: _Options) -> int:
    """Run a recorded pymunk game again, without a window, with its inputs and other settings of the physics.

    The program runs twice in processes of its own, with the events, keys, clock and random numbers that `sandbox
    record` has kept, and both runs must be equal, bit for bit. With other settings they are compared with the game's
    own. The program is that of the user and has the user's rights; it writes to copies of its files. Exit status 1: the
    game fails, or two runs differ.
    """
    faults: list[Fault] = []
    inputs, settings = _read(options, faults)
    if inputs is None or settings is None or faults:
        return exit_with_errors(faults, options.as_json, **to_json(RehearsalDocument(game=options.game)))
    try:
        with status_line(options.is_silent) as progress:
            if progress is not None:
                progress(Progress("rehearsing"))
            document, run = _rehearsed(options, inputs, settings)
        if options.states is not None:
            write_states(run, options.states)
    except RehearsalError as error:
        return exit_with_errors(
            [Fault.of(options.game, str(error))], options.as_json, **to_json(RehearsalDocument(game=options.game))
        )
    except OSError as error:
        fault = Fault.of("--states", f"{error.filename}: {error.strerror or error}")
        return exit_with_errors([fault], options.as_json, **to_json(document))
    if options.as_json:
        print_json(to_json(document))
    elif not options.quiet:
        _print(document)
    for each in document.remarks:
        click.echo(f"{options.game}: {each}", err=True)
    return 0 if document.is_repeatable and document.failure is None else 1


def inputs_path(game: str, inputs: str | None) -> str:
    """Return the file with the inputs of a game: the given one, or GAME.json in the working folder."""
    return inputs if inputs is not None else f"{Path(game).stem}.json"


def read_inputs(game: str, given: str | None) -> GameInputs:
    """Read the inputs of a game.

    Args:
        game: path of the program.
        given: file of the inputs; default: GAME.json in the working folder.

    Raises:
        SceneError: there is no such program, or no such file, or it has no inputs.
    """
    try:
        exists = Path(game).exists()
    except OSError as error:  # the name is too long for the file system
        reason = error.strerror or str(error)
        raise SceneError([Fault.of(shorten(game, MAX_NAMED), f"cannot be read: {reason}")]) from None
    if not exists:
        raise SceneError([Fault.of(game, "does not exist; name the Python file of the game")])
    path = inputs_path(game, given)
    if given is None and not Path(path).exists():
        raise SceneError(
            [Fault.of(game, f"its inputs are not recorded: {path} does not exist; `sandbox record {game}` writes it")]
        )
    return load_inputs(path)


def changed_files(game: str, inputs: GameInputs) -> list[str]:
    """Return the files of a program that have changed since it was recorded."""
    path = Path(game)
    folder = path if path.is_dir() else path.parent
    files = ((name, folder / name, digest) for name, digest in inputs.digests.items())
    return [name for name, file, digest in files if not file.is_file() or file_digest(file) != digest]


def remarks_on_inputs(game: str, inputs: GameInputs) -> list[str]:
    """Return what a rehearsal of a game lacks: what inputs do not have, and files that have changed."""
    remarks = [f"the recording does not have {note}" for note in inputs.notes]
    changed = changed_files(game, inputs)
    if changed:
        remarks.append(f"changed since the recording: {', '.join(changed)}")
    return remarks


def _read(options: _Options, faults: list[Fault]) -> tuple[GameInputs | None, RehearsalSettings | None]:
    inputs: GameInputs | None = None
    settings: RehearsalSettings | None = None
    with collect_errors(faults):
        inputs = read_inputs(options.game, options.inputs)
    values: dict[str, str] = {}
    for each in options.overrides:
        name, separator, value = each.partition("=")
        if not separator:
            faults.append(Fault.of("--set", f"{short_repr(each)} is not KEY=VALUE"))
        values[name.strip().removeprefix("solver.")] = value.strip()
    for name in ("substeps", "iterations", "dt"):
        if (given := getattr(options, name)) is not None:
            values[name] = str(given)
    with collect_errors(faults, "--set", (ValueError,)):
        settings = RehearsalSettings.of(values)
    if options.states is not None:
        name = shorten(str(options.states), MAX_NAMED)
        faults += [Fault.of("--states", f"{name}: {reason}") for reason in reasons_not_writable(options.states)]
        if options.states.suffix != ".npz":
            faults.append(Fault.of("--states", f"{name}: is no .npz file"))
    return inputs, settings


def _rehearsed(
    options: _Options, inputs: GameInputs, settings: RehearsalSettings
) -> tuple[RehearsalDocument, Rehearsal]:
    """Run the game twice, and with other settings also with its own.

    Raises:
        RehearsalError: a run has no result.
    """
    limits: dict[str, Any] = {"time_limit": options.time_limit, "memory_limit": options.memory_limit}
    run = rehearse(options.game, inputs, settings, **limits)
    document = RehearsalDocument(
        game=options.game,
        inputs=inputs_path(options.game, options.inputs),
        settings=settings.changed,
        frames=run.frames,
        duration=inputs.duration,
        steps=run.steps,
        bodies=max((len(run.frame(number)[0]) for number in range(run.frames)), default=0),
        callbacks=_callback_counts(run),
        calls=[
            CallbackEntry(
                frame=each.frame,
                callback=str(run.callbacks[each.callback]),
                bodies=[run.body_name(run.shape_bodies[shape]) for shape in each.shapes],
                calls=each.calls,
            )
            for each in run.calls
        ],
        added=_change_counts(run, is_added=True),
        removed=_change_counts(run, is_added=False),
        frame_hashes=run.hashes,
        output=run.output,
        ended=run.ended,
        failure=run.failure,
        remarks=(*remarks_on_inputs(options.game, inputs), *(f"left out: {note}" for note in run.notes)),
    )
    if run.failure is not None:
        return document, run
    mismatch = first_mismatch(run, rehearse(options.game, inputs, settings, draws=False, **limits))
    is_own = not settings.changed
    differs = None if mismatch is None else f"two runs differ: {mismatch}"
    equals: bool | None = None
    if is_own:
        frame = first_difference(run.hashes, inputs.frame_hashes)
        equals = frame is None
        differs = differs or (None if frame is None else f"the rehearsal differs from the recorded game: frame {frame}")
    elif mismatch is None:
        own = rehearse(options.game, inputs, **limits)
        found = difference_from(GameTruth(own, {}, frozenset()), run, 0.0)
        lost = [each for each in found.callbacks if not each.is_equal]
        document = replace(
            document, from_own=FromOwn(error=found.error, body=found.body, frame=found.frame, callbacks=lost)
        )
    causes: Sequence[str] = ()
    if differs is not None:
        # Repeatable, but not as recorded: with another program that is no fault of the inputs.
        changed = changed_files(options.game, inputs) if mismatch is None else []
        causes = [f"{each} has changed since the recording" for each in changed]
        if mismatch is None and Path(options.game).name != Path(inputs.program).name:
            causes = [f"the inputs are those of {inputs.program}"]
        causes = causes or likely_causes(options.game, inputs)
    return (
        replace(
            document,
            is_repeatable=mismatch is None,
            equals_recording=equals,
            first_difference=differs,
            causes=causes,
        ),
        run,
    )


def _callback_counts(run: Rehearsal) -> list[CallbackCount]:
    calls: Counter[str] = Counter()
    for each in run.calls:
        calls[str(run.callbacks[each.callback])] += each.calls
    found: Counter[str] = Counter()
    for (callback, _), frames in contacts(run).items():
        found[str(callback)] += len(frames)
    return [
        CallbackCount(callback=str(each), contacts=found[str(each)], calls=calls[str(each)]) for each in run.callbacks
    ]


def _change_counts(run: Rehearsal, *, is_added: bool) -> dict[str, int]:
    counts = Counter("joints" if each.is_joint else "bodies" for each in run.changes if each.is_added == is_added)
    return {"bodies": counts["bodies"], "joints": counts["joints"]}


def write_states(run: Rehearsal, path: Path) -> None:
    """Write the states of a rehearsal as arrays: `offsets`, `bodies` and `states`, as in `Rehearsal`.

    Raises:
        OSError: the file cannot be written.
    """
    import numpy as np

    from sandbox.atomic_write import atomic_write

    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, offsets=run.offsets, bodies=run.bodies, states=run.states)


def _print(document: RehearsalDocument) -> None:
    settings = ", ".join(f"{name} = {value:g}" for name, value in document.settings.items()) or "its own settings"
    print_line(
        f"{document.game}: {settings}; {format_plural(document.frames, 'frame')} ({document.duration:.3g} s), "
        f"{format_plural(document.steps, 'step')}, at most {format_plural(document.bodies, 'body', 'bodies')}",
        style="bold",
    )
    if document.failure is not None:
        print_item(f"failed: {document.failure}", "")
    elif document.first_difference is not None:
        print_item(document.first_difference, "")
        for cause in document.causes:
            print_item(f"likely cause: {cause}", INDENT)
    elif document.equals_recording:
        print_item("two runs are equal, bit for bit, and equal the recorded game after each frame", "")
    else:
        print_item("two runs are equal, bit for bit", "")
    for each in document.callbacks:
        counts = f"{format_plural(each.contacts, 'contact')}, {format_plural(each.calls, 'call')}"
        print_item(f"{each.callback}: {counts}", INDENT)
    changes = [
        f"{count} {kind if count > 1 else SINGULAR[kind]} {word}"
        for word, counts in (("added", document.added), ("removed", document.removed))
        for kind, count in counts.items()
        if count
    ]
    if changes:
        print_item(f"while it ran: {', '.join(changes)}", INDENT)
    if document.from_own is not None:
        own = document.from_own
        where = "" if own.body is None else f" ({own.body} in frame {own.frame})"
        print_item(f"against its own settings: up to {format_number(own.error)} units of length away{where}", "")
        for difference in own.callbacks:
            counts = f"{difference.missed} missing, {difference.late} at another time, {difference.extra} extra"
            there = f"{format_plural(difference.expected, 'contact')} with its own settings"
            print_item(f"{difference.callback}: {there}; here {counts}", INDENT)
    lines = document.output.strip().splitlines()
    if lines:
        print_item("the game printed:" if len(lines) <= MAX_OUTPUT_LINES else "the game printed, at the end:", "")
        for line in lines[-MAX_OUTPUT_LINES:]:
            print_line(f"{INDENT}{line}")
