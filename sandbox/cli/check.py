"""Command `check`: validate scenes; print required physics, engines that can run them, and predicted problems."""

import math
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import click

from sandbox.cli.common import exit_with_errors, expand_folders, fault_rows, print_faults, scene_path
from sandbox.cli.options import json_option, quiet_option, set_option
from sandbox.cli.streams import print_json
from sandbox.engines.registry import ENGINES, UnknownEngineError, engine_named
from sandbox.games.registry import fitting_rules
from sandbox.measure.preflight import (
    FAILED,
    PreflightResult,
    floor_3_digits,
    largest_safe_dt,
    notes,
    run_preflight,
    unknown_speeds,
)
from sandbox.scene.compile.demands import JOINTS, Item, bill
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import dumps, load


@dataclass
class _Answers:
    """JSON documents of the scenes checked so far, and the exit status."""

    documents: list[dict[str, Any]] = field(default_factory=list)
    status: int = 0

    def add(self, document: dict[str, Any], status: int = 0) -> None:
        """Add a scene's document; the highest status counts."""
        self.documents.append(document)
        self.status = max(self.status, status)


@click.command(name="check")
@click.argument("scenes", nargs=-1, required=True)
@set_option("set a value of the scene first")
@click.option("--engine", metavar="NAME", help="print the warnings for this engine only, and use it for the trial run")
@click.option("--no-trial", is_flag=True, help="predict by formulas only, without the short trial run")
@json_option
@quiet_option("print faults and warnings only")
@click.option(
    "--expand", is_flag=True, help="print the scene as TOML with its presets (tables, racks) expanded to primitives"
)
def check_command(
    scenes: tuple[str, ...],
    overrides: tuple[str, ...],
    engine: str | None,
    no_trial: bool,
    as_json: bool,
    quiet: bool,
    expand: bool,
) -> int:
    """Validate scenes and predict numerical problems: required physics, engines that can run the scene, warnings.

    Warnings come from formulas and from a trial run of at most 10,000 substeps on --engine (default: pymunk). SCENES
    are files, folders of files, or names of shipped scenes. Exit status 1: no engine can run a scene, or it fails.
    """
    if expand:
        if len(scenes) > 1 or as_json:
            raise click.UsageError("--expand prints one scene as TOML: name one scene and leave out --json")
        return _expand(scenes[0], overrides)
    if engine is not None:
        try:
            engine_named(engine)
        except UnknownEngineError as error:
            return exit_with_errors([Fault("--engine", None, "", str(error))], as_json)
    answers, names = _Answers(), expand_folders(scenes)
    for name in names:
        try:
            scene, document, items = _check(name, overrides, engine, 0.0 if no_trial else 1.0)
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
            fault = Fault(name, None, "", message)
            answers.add(_faulty(name, [fault]), 1)
            click.echo(str(fault), err=True)
        else:
            answers.add(document, _status(document, engine))
            if not as_json:
                _print(name, scene, document, items, quiet)
    if as_json:
        print_json(answers.documents[0] if len(answers.documents) == len(names) == 1 else {"scenes": answers.documents})
    return answers.status


def _check(
    name: str, overrides: tuple[str, ...], engine: str | None, cover: float
) -> tuple[Scene, dict[str, Any], tuple[Item, ...]]:
    """Return a scene, its JSON document, and the physics that it requires; see `_checked`.

    Raises:
        SceneError: the scene has faults.
    """
    scene = load(scene_path(name), overrides)
    rules = fitting_rules(scene, scene_path(name))
    document, items = _checked(name, scene, engine, cover)
    if rules is not None:
        document["game"] = {"name": scene.play.game, "controls": [each._asdict() for each in rules.controls]}
    return scene, document, items


def _status(document: dict[str, Any], engine: str | None) -> int:
    """Return the exit status of a scene: 1 if no engine can run it (or the named one), or if it fails."""
    is_able = any(each["ok"] for known, each in document["engines"].items() if engine in (None, known))
    fails = any(warning["kind"] == FAILED for warning in document["warnings"])
    return 1 if fails or not is_able else 0


def _expand(name: str, overrides: tuple[str, ...]) -> int:
    """Print a scene as TOML with its presets expanded, and return the exit status."""
    try:
        click.echo(dumps(load(scene_path(name), overrides)), nl=False)
    except SceneError as error:
        return exit_with_errors(error.faults)
    return 0


def _faulty(name: str, faults: Sequence[Fault]) -> dict[str, Any]:
    """Return the JSON document of a scene with faults."""
    empty: dict[str, Any] = {"demands": [], "engines": {}, "warnings": [], "notes": []}
    return {"scene": name, "title": None, "ok": False, "faults": fault_rows(faults), **empty}


def _checked(name: str, scene: Scene, engine: str | None, cover: float) -> tuple[dict[str, Any], tuple[Item, ...]]:
    """Return the JSON document of a scene, and the physics that it requires.

    Args:
        name: the scene as the user named it.
        scene: the scene.
        engine: engine of the warnings and the trial run; None for the default.
        cover: fraction of the longest allowed trial run; 0 for none.
    """
    items = bill(scene)
    engines = {}
    for each in ENGINES.values():
        missing = each.missing(scene, scene.solver)
        engines[each.name] = {"ok": not missing, "missing": list(missing)}
    safe = largest_safe_dt(scene)
    answer = run_preflight(scene, engine=engine, cover=cover)
    document = {
        "scene": name,
        "title": scene.title,
        "ok": True,
        "faults": [],
        "demands": [str(item.demand) for item in items if item.on],
        "bill": [{"demand": str(item.demand), "on": item.on, "why": item.why} for item in items],
        "engines": engines,
        "step": {"dt": scene.solver.dt, "substeps": scene.solver.substeps},
        "safe_dt": safe if safe is not None and math.isfinite(safe) else None,
        "safe_dt_known": safe is not None,
        "trial": _trial(answer),
        "warnings": [{"kind": w.kind, "message": w.message, **w.details} for w in answer.warnings],
        "notes": [{"kind": n.kind, "message": n.message, **n.details} for n in (*notes(scene), *answer.refuted)],
    }
    return document, items


def _trial(answer: PreflightResult) -> dict[str, Any] | None:
    """Return the engine and the duration of the trial run; None if there was none."""
    if answer.tried is None:
        return None
    return {"engine": answer.tried.engine, "duration": answer.tried.duration, "whole": answer.tried.whole}


def _print(name: str, scene: Scene, document: dict[str, Any], items: tuple[Item, ...], quiet: bool) -> None:
    """Print the result for a scene; with `quiet`, only the warnings."""
    if quiet:
        for warning in document["warnings"]:
            click.echo(f"{name}: warning: {warning['message']}")
        return
    click.echo(f"{name}: {scene.title}" if scene.title else name)
    for is_on, what, why in _demand_lines(items):
        mark = click.style("on ", fg="green", bold=True) if is_on else click.style("off", dim=True)
        click.echo(f"  {mark}  {what:<14} {why}")
    for engine, verdict in document["engines"].items():
        _print_item(f"engine {engine}: {'; '.join(verdict['missing']) or 'models everything in the scene'}")
    _print_item(_step_text(scene, document))
    if (trial := document["trial"]) is not None and not trial["whole"]:
        covered = f"{trial['duration']:.3g} s of {scene.world.duration:g} s"
        _print_item(f"the trial run on {trial['engine']} covered {covered}")
    if "game" in document:
        keys = (f"{each['name']} ({' or '.join(each['keys'])})" for each in document["game"]["controls"])
        _print_item(f"game {document['game']['name']}: {', '.join(keys)}")
    for note in document["notes"]:
        _print_item(f"note: {note['message']}")
    for warning in document["warnings"]:
        _print_item(f"warning: {warning['message']}")


def _step_text(scene: Scene, document: dict[str, Any]) -> str:
    """Return the largest dt without tunnelling, and the step of the scene."""
    safe, step = document["safe_dt"], scene.solver
    limit = "no dt lets a body tunnel" if safe is None else f"no body can tunnel up to dt = {floor_3_digits(safe)} s"
    if not document["safe_dt_known"]:
        causes = ", ".join(unknown_speeds(scene))
        limit = f"the largest dt without tunnelling is unknown, because {causes} may add any speed"
    own = f"dt is {step.dt:g} s"
    if step.substeps > 1:
        own += f" with {step.substeps} substeps, so a step takes {step.h:g} s"
    return f"{limit}; the scene's {own}"


def _demand_lines(items: tuple[Item, ...]) -> Iterator[tuple[bool, str, str]]:
    """Yield the required physics; of joints only the kinds that are required, or one line if none is."""
    has_joints = any(item.on for item in items if item.demand in JOINTS)
    is_listed = False
    for demand, on, why in items:
        if on or demand not in JOINTS:
            yield on, str(demand), why
        elif not (has_joints or is_listed):
            is_listed = True
            yield False, "joints", "none"


def _print_item(text: str) -> None:
    """Print one item; on a terminal it is wrapped between words, otherwise it is one line."""
    if sys.stdout.isatty():
        width = shutil.get_terminal_size().columns
        click.echo(click.wrap_text(text, width, initial_indent="  ", subsequent_indent="    "))
    else:
        click.echo(f"  {text}")
