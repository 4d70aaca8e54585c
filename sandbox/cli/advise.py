"""Command `advise`: which dt, how many iterations, which engine a game needs, on one page."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from click.core import ParameterSource

from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    reasons_not_writable,
    scene_path,
    scene_paths,
    suggest_names,
)
from sandbox.cli.options import (
    POSITIVE,
    OutputOptions,
    json_option,
    quiet_option,
    set_option,
    takes,
    time_limit_option,
)
from sandbox.cli.progress import status_line
from sandbox.cli.recordings import is_recording, report_remarks
from sandbox.cli.starts import margin_option, recommendation_starts_option, spread_option
from sandbox.cli.streams import print_json
from sandbox.cli.tables import add_columns, format_optional, new_table, print_item, print_line, print_table
from sandbox.echo import MAX_NAMED, shorten
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.game_inputs import load_inputs
from sandbox.measure.advice.result import Advice, Knob, MeasuredSetting, OtherEngine
from sandbox.measure.advice.study import DEFAULT_FPS, DEFAULT_ZOOM, advise
from sandbox.measure.advice.text import (
    OBJECTIONS,
    cheapest_head,
    coverage_sentence,
    engine_text,
    error_text,
    fallback_head,
    figures_text,
    knob_head,
    no_setting_text,
    pixels_text,
    ratio_text,
    recording_sentences,
    risk_label,
    risk_text,
    search_sentence,
    setting_text,
    target_text,
    truth_sentences,
)
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.sessions import read_session
from sandbox.measure.tradeoff.study import DEFAULT_EFFORT, DEFAULT_REPEATS
from sandbox.recording import Recording
from sandbox.recording_remarks import is_in_pixels, remarks_on
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load

MAX_RISKS = 6
"""Risks of a setting that are printed; the page and the JSON document have all."""
MAX_REASON = 100
"""Characters of the reason why a setting failed, in a table."""
INDENT = "   "

TIME_UNITS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "µs": 1e-3, "μs": 1e-3}
"""Units of `--budget`, ms"""
LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Units of `--tolerance` besides px, m"""
PX = "px"
PIXELS = 1.0
"""Pixels per unit of length, if that is the pixel"""
QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*")


class Quantity(click.ParamType):  # type: ignore[type-arg]  # generic in newer versions of click alone
    """Positive number with a unit, as in `4ms`; the value is the number and the unit.

    Args:
        name: name for messages.
        units: known units.
        example: example for messages.
    """

    def __init__(self, name: str, units: tuple[str, ...], example: str) -> None:
        self.name = name
        self._units, self._example = units, example

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, str]:
        """Return number and unit.

        Raises:
            click.BadParameter: the text is no positive number with a known unit.
        """
        if isinstance(value, tuple):
            return value
        units = ", ".join(self._units)
        found = QUANTITY.fullmatch(str(value))
        if found is None:
            self.fail(f"{shorten(str(value))!r} is not a number with a unit, such as {self._example}", param, ctx)
        number, unit = float(found[1]), found[2]
        if not unit:
            self.fail(f"{value!r} has no unit; units: {units}, as in {self._example}", param, ctx)
        if unit not in self._units:
            hint = suggest_names(unit, self._units)
            self.fail(f"{shorten(unit)!r} is not one of the units {units}; {hint}", param, ctx)
        if not 0.0 < number < float("inf"):
            self.fail(f"{value!r} must be positive and finite", param, ctx)
        return number, unit


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scene: str
    inputs: str | None
    takes_scene: bool
    engine: str | None
    overrides: tuple[str, ...]
    fps: float
    budget: tuple[float, str] | None
    tolerance: tuple[float, str]
    margin: float
    given_zoom: float | None
    pixels: bool
    starts: int
    spread: float
    effort: float
    time_limit: float | None
    repeats: int
    out: Path | None

    def zoom(self, recording: Recording | None) -> float:
        """Pixels per metre: as given; 1 for the recording of a game whose bodies have the sizes of pixel graphics."""
        if self.pixels or (self.given_zoom is None and _looks_like_pixels(recording)):
            return PIXELS
        return DEFAULT_ZOOM if self.given_zoom is None else self.given_zoom

    def tolerance_metres(self, zoom: float) -> float:
        """The tolerance, m, at so many pixels per metre."""
        number, unit = self.tolerance
        return number / zoom if unit == PX else number * LENGTH_UNITS[unit]

    @property
    def budget_ms(self) -> float | None:
        """The budget, ms."""
        return None if self.budget is None else self.budget[0] * TIME_UNITS[self.budget[1]]


@click.command(name="advise")
@click.argument("scene", metavar="SCENE|RECORDING|GAME.py")
@click.option("--inputs", metavar="FILE", help="of GAME.py: recording with its inputs; default: GAME.json")
@click.option("--scene", "takes_scene", is_flag=True, help="of a recorded game: advise on its scene, not the program")
@click.option(
    "--engine", metavar="NAME", help="present engine of the game; default: pymunk, or the engine of the recording"
)
@set_option()
@click.option("--fps", type=POSITIVE, default=DEFAULT_FPS, metavar="N", help="frames per second; default: 60")
@click.option(
    "--budget",
    type=Quantity("time", tuple(TIME_UNITS), "4ms"),
    metavar="TIME",
    help="computing time per frame that is available: 4ms, 500us or 0.004s",
)
@click.option(
    "--tolerance",
    type=Quantity("length", (PX, *LENGTH_UNITS), "1px"),
    default="1px",
    metavar="LENGTH",
    help="largest allowed error of a position: 1px, 5mm, 2cm or 0.02m; default: 1px",
)
@margin_option
@click.option(
    "--zoom",
    "given_zoom",
    type=POSITIVE,
    metavar="PX",
    help="pixels per metre; default: 50, or as --pixels for the recording of a game whose bodies look like pixels",
)
@click.option("--pixels", is_flag=True, help="the unit of length is the pixel, as --zoom 1")
@recommendation_starts_option
@spread_option
@click.option(
    "--effort",
    type=POSITIVE,
    default=DEFAULT_EFFORT,
    metavar="N",
    help=f"effort of the search, as of `tradeoff`; default: {DEFAULT_EFFORT:g}",
)
@time_limit_option("time limit of the search, s; the settings tried then depend on the machine; default: no limit")
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=DEFAULT_REPEATS,
    metavar="N",
    help=f"timings of each setting that is printed; default: {DEFAULT_REPEATS}",
)
@click.option("--out", type=click.Path(path_type=Path), metavar="FILE", help="write the advice as an HTML page")
@json_option
@quiet_option()
@takes(_Options)
def advise_command(options: _Options) -> int:
    """Answer which dt, how many iterations and which engine a game needs.

    Prints the forecast and the measured error of the present setting, the cheapest setting within the tolerance, the
    effect of each single change, the price of the other engines, and the lines of code to change. All settings that
    are considered step once a frame, dt = 1/fps, with substeps. SCENE|RECORDING is a scene file, the name of a shipped
    scene, or a recorded session (.json). GAME.py is a pymunk game whose inputs `sandbox record` has kept: the game
    itself runs again with other settings, as does a recording whose program is found. Exit status 1: no setting is
    within the tolerance and the budget.
    """
    program = _program(options)
    if program is not None:
        return _advise_game(options, program)
    faults: list[Fault] = []
    if options.engine is not None:
        with collect_errors(faults, "--engine", (UnknownEngineError,)):
            engine_named(options.engine)
    read = _read(options, faults)
    zoom = options.zoom(read if isinstance(read, Recording) else None)
    advice: Advice | None = None
    if read is not None and not faults:
        with (
            collect_errors(faults, options.scene, (TooLargeError, ValueError)),
            status_line(options.is_silent) as progress,
        ):
            advice = advise(
                read,
                options.engine,
                fps=options.fps,
                tolerance=options.tolerance_metres(zoom),
                margin=options.margin,
                budget=options.budget_ms,
                zoom=zoom,
                starts=options.starts,
                spread=options.spread,
                effort=options.effort,
                time_limit=options.time_limit,
                repeats=options.repeats,
                on_progress=progress,
            )
    if advice is None:
        return exit_with_errors(faults, options.as_json, scene=options.scene)
    remarks = _remarks(read, options)
    report_remarks(options.scene, remarks)
    if options.as_json:
        print_json(advice.document(options.scene) | ({"remarks": remarks} if remarks else {}))
    elif not options.quiet:
        print_advice(options.scene, advice)
    status = 0 if advice.is_met else 1
    if advice.interrupted:
        click.echo("interrupted: what was measured so far is kept", err=True)
        status = 130
    return max(status, _write_page(advice, options, remarks))


def _program(options: _Options) -> str | None:
    """Return the program to advise on: that of the command line, or that of a recording; None for a scene."""
    from sandbox.cli.advise_game import is_game, program_of

    if is_game(options.scene):
        return options.scene
    if options.takes_scene or not is_recording(options.scene) or not Path(options.scene).is_file():
        return None
    try:
        inputs = load_inputs(options.scene)
    except SceneError:  # a recording without inputs
        return None
    program = program_of(options.scene, inputs)
    if program is None:
        reason = f"{inputs.program} is not there, or has changed since the recording"
        click.echo(f"{options.scene}: {reason}: advice on the scene of the recording", err=True)
    return program


SCENE_ONLY = frozenset({"engine", "overrides", "fps", "margin", "spread", "effort", "repeats"})
"""Options that have no effect on a game itself"""


def _advise_game(options: _Options, program: str) -> int:
    from sandbox.cli.advise_game import advise_game, is_game

    context = click.get_current_context()
    sources = {each.name: context.get_parameter_source(each.name or "") for each in context.command.params}
    typed = {name for name, source in sources.items() if source == ParameterSource.COMMANDLINE}
    given = [each.opts[0] for each in context.command.params if each.name in typed & SCENE_ONLY]
    remedy = "" if is_game(options.scene) else "; add --scene to advise on the scene of the recording"
    faults = [Fault.of(each, f"has no effect on a game itself{remedy}") for each in given]
    if options.takes_scene:
        faults.append(Fault.of("--scene", f"{options.scene} is a program; name its recording"))
    faults += _output_faults(options)
    if faults:
        return exit_with_errors(faults, options.as_json, scene=options.scene)
    return advise_game(
        program,
        options.inputs if is_game(options.scene) else options.scene,
        tolerance=options.tolerance,
        zoom=PIXELS if options.pixels else options.given_zoom,
        budget_ms=options.budget_ms,
        plays=None if "starts" not in typed else 0 if options.starts == 1 else options.starts,
        time_limit=options.time_limit,
        out=options.out,
        as_json=options.as_json,
        quiet=options.quiet,
    )


def _looks_like_pixels(recording: Recording | None) -> bool:
    return recording is not None and recording.game is not None and is_in_pixels(recording.scene)


def _remarks(read: Scene | Recording | None, options: _Options) -> list[str]:
    """Return the remarks on a recording, and that its unit of length is taken for the pixel; empty for a scene."""
    if not isinstance(read, Recording):
        return []
    remarks = [*remarks_on(read)]
    if options.given_zoom is None and not options.pixels and _looks_like_pixels(read):
        bodies = read.scene.bodies
        width = 2.0 * float(np.median(bodies.radius[~bodies.fixed]))
        remarks.append(
            f"bodies are {width:.3g} units wide, so the unit of length is taken for the pixel, as with --pixels; "
            f"--zoom {DEFAULT_ZOOM:g} takes it for a metre"
        )
    return remarks


def _read(options: _Options, faults: list[Fault]) -> Scene | Recording | None:
    """Return the scene or the recording; add faults of it, and of the page to write, to the faults."""
    read: Scene | Recording | None = None
    with collect_errors(faults):
        if is_recording(scene_paths([options.scene])[0][1]):
            read = read_session(scene_paths([options.scene])[0][1])
            if options.overrides:
                raise SceneError([Fault.of("--set", "a recording has its scene and settings within it")])
        else:
            read = load(scene_path(options.scene), options.overrides)
    if options.inputs is not None:
        faults.append(Fault.of("--inputs", "is for GAME.py; a scene has no inputs, and a recording its own"))
    faults += _output_faults(options)
    return read


def _output_faults(options: _Options) -> list[Fault]:
    """Return the faults of the unit of length and of the page to write."""
    faults = []
    if options.pixels and options.given_zoom is not None:
        faults.append(Fault.of("--pixels", "is --zoom 1; leave out one of them"))
    if options.out is not None:
        name = shorten(str(options.out), MAX_NAMED)
        faults += [Fault.of("--out", f"{name}: {reason}") for reason in reasons_not_writable(options.out)]
    return faults


def _write_page(advice: Advice, options: _Options, remarks: Sequence[str]) -> int:
    """Write the page of `--out`; return 2 if it cannot be written."""
    if options.out is None:
        return 0
    from sandbox.report.html.advice import write_advice

    try:
        write_advice(advice, options.out, remarks)
    except OSError as error:
        click.echo(f"--out: {error.filename}: {error.strerror}", err=True)
        return 2
    if not options.is_silent:
        click.echo(f"written: {options.out}")
    return 0


def print_advice(scene: str, advice: Advice) -> None:
    """Print the advice in five numbered parts.

    Args:
        scene: the scene as the user named it.
        advice: the advice.
    """
    name = f"{scene} ({advice.scene})" if advice.scene else scene
    coverage = coverage_sentence(advice)
    if coverage is not None:
        print_item(coverage, "")
    _print_heading(f"{name}: {target_text(advice)}")
    for sentence in (*truth_sentences(advice), *recording_sentences(advice)):
        print_item(sentence, "")
    _print_present(advice)
    _print_recommended(advice)
    _print_knobs(advice)
    _print_engines(advice)
    _print_code(advice)
    click.echo()
    print_item(f"{search_sentence(advice)}.", "")


def _print_present(advice: Advice) -> None:
    present = advice.present
    _print_heading(f"1. Present setting: {setting_text(present, advice.fps)}", blank=True)
    print_item(figures_text(advice, present), INDENT)
    if present.status != "refused" and not advice.risks:
        print_item("forecast: no problem", INDENT)
    _print_risks(advice, advice.risks)
    for note in advice.notes:
        print_item(f"note: {note}", INDENT)


def _print_objections(setting: MeasuredSetting) -> None:
    for each in setting.objections[:MAX_RISKS]:
        print_item(f"objection: {each}", INDENT)


def _print_risks(advice: Advice, risks: tuple[Any, ...]) -> None:
    for risk in risks[:MAX_RISKS]:
        print_item(f"{risk_label(risk)}: {risk_text(risk, advice.fps)}", INDENT)
    if len(risks) > MAX_RISKS:
        print_item(f"… and {len(risks) - MAX_RISKS} more; --out and --json list all", INDENT)


def _print_recommended(advice: Advice) -> None:
    chosen = advice.recommended
    if chosen is not None:
        _print_heading(f"2. {cheapest_head(advice)}: {setting_text(chosen, advice.fps)}", blank=True)
        print_item(figures_text(advice, chosen), INDENT)
    else:
        _print_heading(f"2. {cheapest_head(advice)}: {no_setting_text(advice)}", blank=True)
    if advice.fallback is not None:
        print_item(f"{fallback_head(advice)}: {setting_text(advice.fallback, advice.fps)}", INDENT)
        print_item(figures_text(advice, advice.fallback), INDENT)
        _print_objections(advice.fallback)
    elif chosen is not None and advice.fits_budget(chosen) is False:
        print_item("no setting that was tried is within the budget", INDENT)
    if advice.remaining_risks:
        print_item("formulas still forecast, although the measured run may not show it:", INDENT)
        _print_risks(advice, advice.remaining_risks)


def _print_knobs(advice: Advice) -> None:
    if not advice.knobs:
        return
    _print_heading(f"3. {knob_head(advice)}", blank=True)
    table = new_table()
    add_columns(table, [f"{INDENT}change"])
    add_columns(table, (_error_head(advice), "error ratio", "ms per frame", "cost ratio"), "right")
    add_columns(table, [""])
    for knob in advice.knobs:
        table.add_row(*_knob_cells(advice, knob))
    print_table(table)


def _error_head(advice: Advice) -> str:
    if advice.tolerance_px is not None:
        return "error, px"
    return f"{advice.metric}{f', {advice.unit}' if advice.unit else ''}"


def _error_cell(advice: Advice, setting: Any) -> str:
    return pixels_text(setting.error_px) if advice.tolerance_px is not None else format_optional(setting.error)


def _knob_cells(advice: Advice, knob: Knob) -> list[Any]:
    from rich.text import Text

    setting = knob.setting
    remark = ""
    if setting.status != "ok":
        remark = shorten(error_text(advice, setting), MAX_REASON)
    elif (is_within := advice.is_within_tolerance(setting)) is not None:
        remark = "too large" if not is_within else f"within, {OBJECTIONS}" if setting.objections else "within"
    return [
        f"{INDENT}{knob.change}",
        _error_cell(advice, setting),
        ratio_text(knob.error_ratio),
        format_optional(setting.frame_ms),
        ratio_text(knob.cost_ratio, knob.cost_ratio_interval),
        Text(remark, style="dim"),
    ]


def _print_engines(advice: Advice) -> None:
    if not advice.others:
        return
    _print_heading("4. The same tolerance on the other engines", blank=True)
    measured = [other for other in advice.others if other.setting is not None]
    if measured:
        table = new_table()
        add_columns(table, [f"{INDENT}engine", "setting"])
        add_columns(table, (_error_head(advice), "ms per frame", "cost ratio"), "right")
        add_columns(table, [""])
        for other in measured:
            table.add_row(*_engine_cells(advice, other))
        print_table(table)
    for other in advice.others:
        if other.setting is None:
            print_item(f"{other.engine}: {engine_text(advice, other)}", INDENT)


def _engine_cells(advice: Advice, other: OtherEngine) -> list[Any]:
    from rich.text import Text

    setting = other.setting
    assert setting is not None
    return [
        f"{INDENT}{other.engine}",
        setting_text(setting, advice.fps),
        _error_cell(advice, setting),
        format_optional(setting.frame_ms),
        ratio_text(setting.ratio, setting.ratio_interval),
        Text(engine_text(advice, other), style="dim"),
    ]


LANGUAGES: Mapping[str, str] = {
    "python": "lines of a game that uses pymunk",
    "c": "lines of a game that uses Box2D, in metres",
    "toml": "lines of the scene file",
}


def _print_code(advice: Advice) -> None:
    if advice.code is None:
        return
    which = "the recommended setting" if advice.recommended is not None else f"the {fallback_head(advice)}"
    _print_heading(f"5. {which[:1].upper()}{which[1:]} as {LANGUAGES[advice.code.language]}", blank=True)
    for line in advice.code.lines:
        print_line(f"{INDENT} {line}")
    for remark in advice.code.remarks:
        print_item(remark, INDENT)


def _print_heading(text: str, *, blank: bool = False) -> None:
    if blank:
        click.echo()
    print_line(text, style="bold")
