"""`sandbox check`: validate scenes, print the bill of physics, who can run them, and what would go wrong."""

import math
import shutil
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import click

from sandbox.cli.reading import fault_rows, path_of, print_faults, print_json, refused, scenes_of
from sandbox.engines.registry import ENGINES, UnknownEngineError, engine_named
from sandbox.games.registry import fitting_rules
from sandbox.measure.forecast import FAILED, Answer, at_most, forecast, largest_safe_dt, notes, unknown_speeds
from sandbox.scene.compile.demands import JOINTS, Item, bill
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import dumps, load
from sandbox.scene.scene import Scene


@click.command(name="check")
@click.argument("scenes", nargs=-1, required=True)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene first")
@click.option("--engine", metavar="NAME", help="print the warnings for this engine only, and use it for the trial run")
@click.option("--no-trial", is_flag=True, help="predict by formulas only, without the short trial run")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="print faults and warnings only")
@click.option(
    "--expand", is_flag=True, help="print the scene as TOML with its presets (tables, racks) expanded to primitives"
)
def command(
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
            return refused([Fault("--engine", None, "", str(error))], as_json)
    documents: list[dict[str, Any]] = []
    status, names = 0, scenes_of(scenes)
    for name in names:
        try:
            scene = load(path_of(name), overrides)
            rules = fitting_rules(scene, path_of(name))
            document, items = _checked(name, scene, engine, 0.0 if no_trial else 1.0)
        except KeyboardInterrupt:
            status = 130
            click.echo(f"interrupted: {len(documents):,} of {len(names):,} scenes were checked", err=True)
            break
        except SceneError as error:
            status = 2
            documents.append(_faulty(name, error.faults))
            if not as_json:
                print_faults(error.faults)
            continue
        except Exception as error:  # noqa: BLE001, one scene's failure must not cost the answers of the others
            message = f"check failed with {type(error).__name__}: {error}; please report this scene"
            documents.append(_faulty(name, [fault := Fault(name, None, "", message)]))
            status = max(status, 1)
            click.echo(str(fault), err=True)
            continue
        if rules is not None:
            document["game"] = {"name": scene.play.game, "controls": [each._asdict() for each in rules.controls]}
        documents.append(document)
        able = [each["ok"] for known, each in document["engines"].items() if engine in (None, known)]
        if not any(able) or any(warning["kind"] == FAILED for warning in document["warnings"]):
            status = max(status, 1)
        if not as_json:
            _print(name, scene, document, items, quiet)
    if as_json:
        print_json(documents[0] if len(documents) == len(names) == 1 else {"scenes": documents})
    return status


def _expand(name: str, overrides: tuple[str, ...]) -> int:
    """Print a scene as it is once its presets are written out."""
    try:
        click.echo(dumps(load(path_of(name), overrides)), nl=False)
    except SceneError as error:
        return refused(error.faults)
    return 0


def _faulty(name: str, faults: Sequence[Fault]) -> dict[str, Any]:
    empty: dict[str, Any] = {"demands": [], "engines": {}, "warnings": [], "notes": []}
    return {"scene": name, "title": None, "ok": False, "faults": fault_rows(faults), **empty}


def _checked(name: str, scene: Scene, engine: str | None, cover: float) -> tuple[dict[str, Any], tuple[Item, ...]]:
    items = bill(scene)
    engines = {}
    for each in ENGINES.values():
        missing = each.missing(scene, scene.solver)
        engines[each.name] = {"ok": not missing, "missing": list(missing)}
    safe = largest_safe_dt(scene)
    answer = forecast(scene, engine=engine, cover=cover)
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
        "warnings": [{"kind": w.kind, "message": w.message, **w.figures} for w in answer.warnings],
        "notes": [{"kind": n.kind, "message": n.message, **n.figures} for n in (*notes(scene), *answer.refuted)],
    }
    return document, items


def _trial(answer: Answer) -> dict[str, Any] | None:
    """Return the engine and the length of a trial run, None where there was none."""
    if answer.tried is None:
        return None
    return {"engine": answer.tried.engine, "duration": answer.tried.duration, "whole": answer.tried.whole}


def _print(name: str, scene: Scene, document: dict[str, Any], items: tuple[Item, ...], quiet: bool) -> None:
    if not quiet:
        click.echo(f"{name}: {scene.title}" if scene.title else name)
        for on, what, why in _lines(items):
            mark = click.style("on ", fg="green", bold=True) if on else click.style("off", dim=True)
            click.echo(f"  {mark}  {what:<14} {why}")
        for engine, verdict in document["engines"].items():
            _tell(f"engine {engine}: {'; '.join(verdict['missing']) or 'models everything in the scene'}")
        safe, step = document["safe_dt"], scene.solver
        say = "no dt lets a body tunnel" if safe is None else f"no body can tunnel up to dt = {at_most(safe)} s"
        if not document["safe_dt_known"]:
            say = (
                f"the largest dt without tunnelling is unknown, because {', '.join(unknown_speeds(scene))} "
                "may add any speed"
            )
        own = f"dt is {step.dt:g} s with {step.substeps} substeps, so a step takes {step.h:g} s"
        _tell(f"{say}; the scene's {own if step.substeps > 1 else f'dt is {step.dt:g} s'}")
        if (trial := document["trial"]) is not None and not trial["whole"]:
            _tell(f"the trial run on {trial['engine']} covered {trial['duration']:.3g} s of {scene.world.duration:g} s")
        if "game" in document:
            keys = (f"{each['name']} ({' or '.join(each['keys'])})" for each in document["game"]["controls"])
            _tell(f"game {document['game']['name']}: {', '.join(keys)}")
        for note in document["notes"]:
            _tell(f"note: {note['message']}")
    for warning in document["warnings"]:
        if quiet:
            click.echo(f"{name}: warning: {warning['message']}")
        else:
            _tell(f"warning: {warning['message']}")


def _lines(items: tuple[Item, ...]) -> Iterator[tuple[bool, str, str]]:
    """Yield the bill's lines: of joints only the kinds that there are, or that there are none."""
    joined = any(item.on for item in items if item.demand in JOINTS)
    told = False
    for demand, on, why in items:
        if on or demand not in JOINTS:
            yield on, str(demand), why
        elif not (joined or told):
            told = True
            yield False, "joints", "none"


def _tell(text: str) -> None:
    """Print one item, folded between words on a terminal; elsewhere an item is a line."""
    if sys.stdout.isatty():
        width = shutil.get_terminal_size().columns
        click.echo(click.wrap_text(text, width, initial_indent="  ", subsequent_indent="    "))
    else:
        click.echo(f"  {text}")
