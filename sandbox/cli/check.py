"""Command `check`: validate scenes; print required physics, engines that can run them, and predicted problems."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import click

from sandbox.cli.common import exit_with_errors, expand_folders, print_faults
from sandbox.cli.options import json_option, quiet_option, set_option
from sandbox.cli.recordings import read_scene, report_remarks
from sandbox.cli.starts import spread_option, starts_option
from sandbox.cli.streams import print_json
from sandbox.cli.tables import print_descriptions, print_item
from sandbox.echo import MAX_MESSAGE, shorten
from sandbox.engines.registry import ENGINES, UnknownEngineError, engine_named
from sandbox.games.contract import Control
from sandbox.games.registry import rules_of
from sandbox.jsonable import finite, in_json, to_json
from sandbox.measure.preflight import (
    FAILED,
    Diagnostic,
    TrialCoverage,
    floor_3_digits,
    largest_safe_dt,
    notes,
    run_preflight,
    unknown_speeds,
)
from sandbox.measure.starts import Starts
from sandbox.scene.compile.demands import JOINT_LIMITS, JOINTS, Item, bill
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import dumps


class EngineSupport(NamedTuple):
    """Whether an engine can run a scene."""

    ok: bool
    missing: tuple[str, ...]
    """physics of the scene that it does not model"""


class StepSettings(NamedTuple):
    """Step of a scene."""

    dt: float
    """s"""
    substeps: int


class GameSummary(NamedTuple):
    """Game of a scene."""

    name: str
    controls: tuple[Control, ...]


@dataclass(frozen=True, kw_only=True)
class CheckDocument:
    """JSON document of a scene: its faults, or the physics that it requires and the problems to expect."""

    scene: str
    """as the user named it"""
    title: str | None = None
    ok: bool
    """whether the scene has no fault"""
    faults: Sequence[Fault] = ()
    demands: Sequence[str] = ()
    """the required physics"""
    bill: Sequence[Item] = ()
    """every demand, and whether the scene makes it"""
    engines: Mapping[str, EngineSupport] = field(default_factory=dict)
    step: StepSettings | None = None
    safe_dt: float | None = None
    """s, largest dt without tunnelling; None if any dt is safe, or it is unknown"""
    safe_dt_known: bool = False
    trial: TrialCoverage | None = None
    """the trial runs; None if there were none"""
    warnings: Sequence[Diagnostic] = ()
    notes: Sequence[Diagnostic] = ()
    game: GameSummary | None = field(default=None, metadata=in_json(optional=True))
    remarks: Sequence[str] | None = field(default=None, metadata=in_json(optional=True))
    """of a recording: what it lacks, and that its scene is checked without its actions"""


@dataclass
class _Answers:
    """JSON documents of the scenes checked so far, and the exit status."""

    documents: list[CheckDocument] = field(default_factory=list)
    status: int = 0

    def add(self, document: CheckDocument, status: int = 0) -> None:
        """Add a scene's document; the highest status counts."""
        self.documents.append(document)
        self.status = max(self.status, status)


@click.command(name="check")
@click.argument("scenes", nargs=-1, required=True)
@set_option("set a value of the scene first")
@click.option("--engine", metavar="NAME", help="print the warnings for this engine only, and use it for the trial run")
@click.option("--no-trial", is_flag=True, help="predict by formulas only, without the short trial runs")
@starts_option("count the problems in trial runs from N perturbed starts")
@spread_option
@json_option
@quiet_option("print faults and warnings only")
@click.option(
    "--expand", is_flag=True, help="print the scene as TOML with its presets (tables, racks) expanded to primitives"
)
@click.option("-v", "--verbose", is_flag=True, help="list the physics that a scene does not need, too")
def check_command(
    scenes: tuple[str, ...],
    overrides: tuple[str, ...],
    engine: str | None,
    no_trial: bool,
    starts: int,
    spread: float,
    as_json: bool,
    quiet: bool,
    expand: bool,
    verbose: bool,
) -> int:
    """Validate scenes and predict numerical problems: required physics, engines that can run the scene, warnings.

    Warnings come from formulas and from trial runs of at most 10,000 substeps on --engine (default: pymunk), from
    perturbed starts. SCENES are files, folders of files, names of shipped scenes, or recorded sessions (.json), whose
    scenes are checked without their actions. Exit status 1: no engine can run a scene, or it fails.
    """
    if expand:
        if len(scenes) > 1 or as_json:
            raise click.UsageError("--expand prints one scene as TOML: name one scene and leave out --json")
        return _expand(scenes[0], overrides)
    if engine is not None:
        try:
            engine_named(engine)
        except UnknownEngineError as error:
            return exit_with_errors([Fault.of("--engine", str(error))], as_json)
    answers, names = _Answers(), expand_folders(scenes)
    for name in names:
        try:
            scene, document = _check(name, overrides, engine, 0 if no_trial else starts, spread)
        except KeyboardInterrupt:
            answers.status = 130
            click.echo(f"interrupted: {len(answers.documents):,} of {len(names):,} scenes were checked", err=True)
            break
        except SceneError as error:
            answers.add(_faulty(name, error.faults), 2)
            if not as_json:
                print_faults(error.faults)
        except Exception as error:  # noqa: BLE001, a failure on one scene must not lose the answers for the others
            message = f"check failed with {type(error).__name__}: {error}; please report this scene"
            fault = Fault.of(name, message)
            answers.add(_faulty(name, [fault]), 1)
            click.echo(str(fault), err=True)
        else:
            answers.add(document, _status(document, engine))
            report_remarks(name, document.remarks or ())
            if not as_json:
                _print(scene, document, quiet, verbose)
    if as_json:
        documents = to_json(answers.documents)
        print_json(documents[0] if len(documents) == len(names) == 1 else {"scenes": documents})
    return answers.status


def _check(
    name: str, overrides: tuple[str, ...], engine: str | None, starts: int, spread: float
) -> tuple[Scene, CheckDocument]:
    """Return a scene and its document.

    Args:
        name: the scene as the user named it.
        overrides: values to set first.
        engine: engine of the warnings and the trial runs; None for the default.
        starts: largest number of trial runs; 0 for none.
        spread: largest change of a start, as a fraction.

    Raises:
        SceneError: the scene has faults.
    """
    path, scene, remarks = read_scene(name, overrides)
    rules = rules_of(scene, path)
    items = bill(scene)
    missing = {each.name: each.missing(scene, scene.solver) for each in ENGINES.values()}
    safe = largest_safe_dt(scene, engine=engine)
    answer = run_preflight(scene, engine=engine, cover=float(starts > 0), starts=starts, spread=spread)
    return scene, CheckDocument(
        scene=name,
        title=scene.title,
        ok=True,
        demands=[str(item.demand) for item in items if item.on],
        bill=items,
        engines={known: EngineSupport(not lacking, tuple(lacking)) for known, lacking in missing.items()},
        step=StepSettings(scene.solver.dt, scene.solver.substeps),
        safe_dt=finite(safe),
        safe_dt_known=safe is not None,
        trial=answer.tried,
        warnings=answer.warnings,
        notes=[*notes(scene, engine), *answer.refuted],
        game=None if rules is None else GameSummary(scene.play.game or "", tuple(rules.controls)),
        remarks=remarks or None,
    )


def _status(document: CheckDocument, engine: str | None) -> int:
    """Return the exit status of a scene: 1 if no engine can run it (or the named one), or if it fails."""
    is_able = any(each.ok for known, each in document.engines.items() if engine in (None, known))
    fails = any(warning.kind == FAILED for warning in document.warnings)
    return 1 if fails or not is_able else 0


def _expand(name: str, overrides: tuple[str, ...]) -> int:
    """Print a scene as TOML with its presets expanded, and return the exit status."""
    try:
        click.echo(dumps(read_scene(name, overrides).scene), nl=False)
    except SceneError as error:
        return exit_with_errors(error.faults)
    return 0


def _faulty(name: str, faults: Sequence[Fault]) -> CheckDocument:
    """Return the document of a scene with faults."""
    shown = [replace(fault, message=shorten(fault.message, MAX_MESSAGE)) for fault in faults]
    return CheckDocument(scene=name, ok=False, faults=shown)


def _print(scene: Scene, document: CheckDocument, quiet: bool, verbose: bool) -> None:
    """Print the result for a scene, warnings first; with `quiet`, only these, and with `verbose`, all demands."""
    name = document.scene
    if quiet:
        for warning in document.warnings:
            click.echo(f"{name}: warning: {warning.message}")
        return
    click.echo(f"{name}: {scene.title}" if scene.title else name)
    if document.trial is not None:
        print_item(_trial_text(scene, document.trial))
    for warning in document.warnings:
        print_item(f"warning: {warning.message}")
    on, off = click.style("on ", fg="green", bold=True), click.style("off", dim=True)
    demands = [*_demand_lines(document.bill)]
    shown = [line for line in demands if verbose or line[0]]
    print_descriptions({f"{on if is_on else off}  {what:<15}": why for is_on, what, why in shown}, "  ")
    if len(shown) < len(demands):
        click.echo(f"  {off}  {len(demands) - len(shown)} others, which -v lists")
    for engine, support in document.engines.items():
        print_item(f"engine {engine}: {'; '.join(support.missing) or 'models everything in the scene'}")
    print_item(_step_text(scene, document))
    if document.game is not None:
        keys = (f"{each.name} ({' or '.join(each.keys)})" for each in document.game.controls)
        print_item(f"game {document.game.name}: {', '.join(keys)}")
    for note in document.notes:
        print_item(f"note: {note.message}")


def _trial_text(scene: Scene, trial: TrialCoverage) -> str:
    """Return the engine of the trial runs, how much of the scene they cover, and their starts."""
    covered = "" if trial.whole else f", for {trial.duration:.3g} s of {scene.world.duration:g} s"
    fewer = "" if trial.limited_by is None else f" of {trial.asked:,} starts, as {trial.limited_by}"
    if trial.starts == 1:
        return f"one trial run on {trial.engine}{covered}{f', from 1{fewer}' if fewer else ''}"
    varied = Starts(scene, trial.spread)
    return f"trial runs on {trial.engine}{covered}, from {trial.starts:,}{fewer or ' starts'}: {varied}"


def _step_text(scene: Scene, document: CheckDocument) -> str:
    """Return the largest dt without tunnelling, and the step of the scene."""
    safe, step = document.safe_dt, scene.solver
    limit = "no dt lets a body tunnel" if safe is None else f"no body can tunnel up to dt = {floor_3_digits(safe)} s"
    if not document.safe_dt_known:
        causes = ", ".join(unknown_speeds(scene))
        limit = f"the largest dt without tunnelling is unknown, because {causes} may add any speed"
    own = f"dt is {step.dt:g} s"
    if step.substeps > 1:
        own += f" with {step.substeps} substeps, so a step takes {step.h:g} s"
    return f"{limit}; the scene's {own}"


def _demand_lines(items: Sequence[Item]) -> Iterator[tuple[bool, str, str]]:
    """Yield the required physics; of joints only the kinds that are required, or one line if none is."""
    has_joints = any(item.on for item in items if item.demand in JOINTS)
    is_listed = False
    for demand, on, why in items:
        if on or demand not in JOINTS | JOINT_LIMITS:
            yield on, str(demand), why
        elif not (has_joints or is_listed):
            is_listed = True
            yield False, "joints", "none"
