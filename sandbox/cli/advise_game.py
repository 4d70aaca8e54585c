"""Advice for a game itself, part of the command `advise`."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import click

from sandbox.cli.common import exit_with_errors
from sandbox.cli.progress import status_line
from sandbox.cli.rehearse import changed_files, read_inputs, remarks_on_inputs
from sandbox.cli.streams import print_json
from sandbox.cli.tables import add_columns, new_table, print_item, print_line, print_table
from sandbox.formatting import format_number, format_plural
from sandbox.game_inputs import GameInputs
from sandbox.measure.game_advice.result import GameAdvice, GameSetting
from sandbox.measure.game_advice.study import (
    DEFAULT_PLAYS,
    DEFAULT_TIME_LIMIT,
    GameFailedError,
    GameStudy,
    NotRepeatableError,
)
from sandbox.measure.game_advice.text import (
    answer_text,
    callback_text,
    contacts_text,
    figures_text,
    present_odds_text,
    recommended_head,
    setting_text,
    target_text,
    truth_sentences,
)
from sandbox.recording import Recording
from sandbox.rehearsal.rehearse import RehearsalError
from sandbox.scene.errors import Fault, SceneError

INDENT = "   "
MAX_CALLBACKS = 12
"""Callbacks of a setting that are printed; the page and the JSON document have all."""


def is_game(name: str) -> bool:
    """Return whether an argument names a program and no scene."""
    path = Path(name)
    try:
        return path.suffix == ".py" or (path / "__main__.py").exists()
    except OSError:  # the name is too long for the file system
        return False


def program_of(recording: str, inputs: GameInputs) -> str | None:
    """Return the program of a recording with inputs, unchanged since; None if it is not found.

    Args:
        recording: path of the recording.
        inputs: in it.
    """
    beside = Path(recording).parent / Path(inputs.program).name
    for path in (Path(inputs.program), inputs.path, beside):
        if path.exists() and not changed_files(str(path), inputs):
            return str(path)
    return None


def _recording_of(inputs: str) -> Recording | None:
    """Return the recording in a file of inputs; None if it has no scene, because the space cannot be one."""
    try:
        return Recording.load(inputs)
    except SceneError:
        return None


def advise_game(
    game: str,
    inputs_file: str | None,
    *,
    tolerance: tuple[float, str],
    zoom: float | None,
    budget_ms: float | None,
    plays: int | None,
    time_limit: float | None,
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Advise on a game, print the advice, and return the exit status.

    Args:
        game: path of the program.
        inputs_file: recording with its inputs; default: GAME.json in the working folder.
        tolerance: accepted error and its unit, px or a length.
        zoom: px per unit of length of the game; None if it was not given.
        budget_ms: time of the physics in a frame that is available, ms.
        plays: number of plays that differ a little from the recorded one; None for the default.
        time_limit: of the advice, s.
        out: page to write.
        as_json: print one JSON document.
        quiet: print nothing.
    """
    try:
        inputs = read_inputs(game, inputs_file)
    except SceneError as error:
        return exit_with_errors(error.faults, as_json, scene=game)
    recording = inputs_file or f"{Path(game).stem}.json"
    recorded, remarks = _recording_of(recording), remarks_on_inputs(game, inputs)
    number, unit = tolerance
    if unit != "px" and zoom is None:
        fault = Fault.of("--tolerance", f"in {unit} needs --zoom, the pixels per metre of the game, or --pixels")
        return exit_with_errors([fault], as_json, scene=game)
    pixels = number if unit == "px" else number * LENGTHS[unit] * (zoom or 1.0)
    try:
        with status_line(as_json or quiet) as progress:
            study = GameStudy(
                game,
                inputs,
                tolerance_px=pixels,
                zoom=zoom,
                plays=DEFAULT_PLAYS if plays is None else plays,
                time_limit=time_limit or DEFAULT_TIME_LIMIT,
                on_progress=progress,
            )
            advice = study.advise()
    except (NotRepeatableError, GameFailedError, RehearsalError) as error:
        faults = [Fault.of(game, line) for line in str(error).splitlines()]
        exit_with_errors(faults, as_json, scene=game)
        return 1
    except KeyboardInterrupt:
        click.echo("interrupted: nothing is advised", err=True)
        return 130
    if as_json:
        print_json(advice.document() | ({"remarks_on_inputs": remarks} if remarks else {}))
    elif not quiet:
        print_game_advice(advice, budget_ms)
        if recorded is not None:
            print_item(f"Other engines run the captured scene only: sandbox advise {recording} --scene", "")
    for each in remarks:
        click.echo(f"{game}: {each}", err=True)
    status = 0 if advice.is_met and not _is_over(advice.recommended, budget_ms) else 1
    if out is None:
        return status
    from sandbox.report.html.game_advice import write_game_advice

    try:
        write_game_advice(advice, study.shown, out, remarks)
    except OSError as error:
        click.echo(f"--out: {error.filename}: {error.strerror}", err=True)
        return 2
    if not (as_json or quiet):
        click.echo(f"written: {out}")
    return status


LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def _is_over(setting: GameSetting | None, budget_ms: float | None) -> bool:
    return setting is not None and budget_ms is not None and setting.physics_ms > budget_ms


def print_game_advice(advice: GameAdvice, budget_ms: float | None) -> None:
    """Print an advice in four numbered parts.

    Args:
        advice: for a game.
        budget_ms: time of the physics in a frame that is available, ms; None if it was not given.
    """
    print_line(f"{advice.program}: {target_text(advice)}", style="bold")
    print_item(answer_text(advice), "")
    for sentence in truth_sentences(advice):
        print_item(sentence, "")
    _print_heading(f"1. Present setting: {setting_text(advice.present)}")
    _print_setting(advice, advice.present, budget_ms)
    if advice.plays.present.trials:
        print_item(present_odds_text(advice), INDENT)
    chosen = advice.chosen
    assert chosen is not None
    if chosen.changed:
        _print_heading(f"2. {recommended_head(advice)}: {setting_text(chosen)}")
        _print_setting(advice, chosen, budget_ms)
        if advice.present.physics_ms:
            ratio = chosen.physics_ms / advice.present.physics_ms
            print_item(f"×{ratio:.3g} the physics of the present setting", INDENT)
    else:
        _print_heading(f"2. {recommended_head(advice)}: the present setting")
    _print_changes(advice)
    if advice.code is not None:
        _print_heading(f"4. Lines to change: {advice.code.file}:{advice.code.line}")
        for line in textwrap.dedent(advice.code.old).splitlines():
            print_line(f"{INDENT}- {line}")
        indent = len(advice.code.old) - len(advice.code.old.lstrip())
        for line in advice.code.new:
            print_line(f"{INDENT}+ {line[indent:]}")
    for each in advice.remarks:
        print_item(each, INDENT)
    click.echo()
    runs = format_plural(advice.runs, "run")
    print_item(f"{format_plural(advice.tried, 'setting')} tried, {runs} of the game, {advice.seconds:.3g} s.", "")
    if advice.out_of_time:
        print_item("The time limit ended the search; --time-limit gives it more.", "")


def _print_setting(advice: GameAdvice, setting: GameSetting, budget_ms: float | None) -> None:
    text = figures_text(advice, setting)
    if budget_ms is not None:
        text += f", {'more than' if _is_over(setting, budget_ms) else 'within'} the budget of {budget_ms:g} ms"
    print_item(text, INDENT)
    shown: Sequence[str] = [callback_text(each, advice) for each in setting.callbacks]
    for each in shown[:MAX_CALLBACKS]:
        print_item(each, INDENT)
    if len(shown) > MAX_CALLBACKS:
        print_item(f"… and {len(shown) - MAX_CALLBACKS} more callbacks; --out and --json list all", INDENT)


def _print_changes(advice: GameAdvice) -> None:
    _print_heading("3. One change at a time of the present setting")
    table = new_table()
    add_columns(table, [f"{INDENT}change"])
    add_columns(table, ("error, px", "contacts", "ms per frame"), "right")
    add_columns(table, [""])
    for each in advice.changes:
        setting = each.setting
        table.add_row(
            f"{INDENT}{each.change}",
            "failed" if setting.error_px is None else format_number(setting.error_px),
            contacts_text(setting),
            format_number(setting.physics_ms),
            "within" if setting.is_within else "",
        )
    print_table(table)


def _print_heading(text: str) -> None:
    click.echo()
    print_line(text, style="bold")
