"""`sandbox compare`: one scene on several engines, scored against the best known truth."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from sandbox.batch.plan import MAX_FAILED, parse_sweep, relabelled, repeated_keys
from sandbox.cli.comparison_table import print_comparison
from sandbox.cli.engine_choice import only_engine
from sandbox.cli.minimising import faults_of, minimised
from sandbox.cli.naming import engines_in, plural
from sandbox.cli.output import make_folder, require_folder, write_json
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.cli.telling import telling
from sandbox.measure.compare import Comparison, Variant, compare_variants
from sandbox.measure.recorder import TooLargeError
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load
from sandbox.scene.files.overrides import AddressError, combinations


@click.command(name="compare")
@click.argument("scene")
@click.option(
    "--engine",
    "--engines",
    "engines",
    metavar="NAME[,NAME]",
    help="engine or engines to run; default: all, or with --sweep those that can run every value",
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=A,B,C",
    help="run once per value; a range is KEY=LOW:HIGH:N[:log]; several sweeps multiply",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="M",
    help="position error at which a run counts as diverged, m; default: 1 % of the smallest ball's radius",
)
@click.option(
    "--why",
    is_flag=True,
    help="rerun with one or two settings changed at a time, and list the changes that lower the error",
)
@click.option(
    "--minimise",
    is_flag=False,
    flag_value="",
    metavar="[FILE]",
    help="remove bodies while the engines (or an engine and the truth) still diverge, and write the smallest scene; "
    "default: SCENE.min.toml in the current folder",
)
@click.option("--force", is_flag=True, help="allow --minimise to replace an existing file")
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR", help="write report.html, plots and comparison.json"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("-v", "--verbose", is_flag=True, help="explain every column of the table")
@click.option("--quiet", is_flag=True, help="print no table and no progress")
def command(
    scene: str,
    engines: str | None,
    overrides: tuple[str, ...],
    sweeps: tuple[str, ...],
    tolerance: float | None,
    why: bool,
    out: Path | None,
    minimise: str | None,
    force: bool,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Run a scene on several engines, or with several values, and measure each error against the best known truth.

    SCENE is a file or the name of a shipped scene. The truth is a closed form, the event-driven engine, or a run with
    ever smaller steps. Exit status 1: an engine failed, diverged, or refused the scene although it was named.
    """
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    axes: list[tuple[str, Sequence[Any]]] = []
    for sweep in sweeps:
        with gathering(faults, "--sweep", (AddressError,)):
            axes.append(parse_sweep(sweep))
    faults += repeated_keys(overrides, sweeps)
    variants: list[Variant] = []
    path = ""
    with gathering(faults), gathering(faults, "--sweep", (AddressError,)):
        path = path_of(scene)
        variants = _variants(path, overrides, axes)
    with gathering(faults, "--tolerance", (ValueError,)):
        if tolerance == float("inf") or tolerance != tolerance:
            raise ValueError(f"is {tolerance} m; it must be finite")
    with gathering(faults):
        require_folder(out)

    smallest = None if minimise is None else Path(minimise or f"{Path(path or scene).stem}.min.toml")
    if smallest is not None:
        faults += faults_of(smallest, path, force)
        if sweeps:
            faults.append(Fault("--minimise", None, "", "works on a single scene; leave out --sweep"))
    elif force:
        faults.append(Fault("--force", None, "", "works only together with --minimise"))

    if out is not None and any(not key.startswith("solver.") for key, _ in axes):
        faults.append(Fault("--out", None, "", "draws a single scene; sweep only keys of solver, or leave out --out"))
    if out is not None and not faults:
        with gathering(faults):
            make_folder(out)
    comparison: Comparison | None = None
    if not faults:
        chosen = None if names is not None else only_engine([each.scene for each in variants], overrides, axes)
        if chosen is not None:
            names = [chosen.engine]
            if not quiet:
                click.echo(chosen.sentence, err=True)
        with gathering(faults, scene, (TooLargeError,)), telling(quiet or as_json) as told:
            comparison = compare_variants(variants, names, tolerance=tolerance, why=why, told=told)
    if comparison is None:
        return refused(faults, as_json, scene=scene, truth=None, engines=[])

    status = 0
    for row in comparison.rows:
        if row.status != "ok" and (row.status != "refused" or names is not None or axes):
            status = 1
            what = row.reason if row.status == "refused" else f"{row.name} {row.status}: {row.reason}"
            click.echo(f"{scene}: {what}", err=True)
    document = comparison.document(scene)
    if not as_json and not quiet:
        print_comparison(scene, comparison, why, refusals=names is None and not axes, verbose=verbose)
    if comparison.interrupted:
        click.echo(f"interrupted: {plural(len(comparison.rows), 'run')} complete; the results are kept", err=True)
        status = 130
    elif smallest is not None:
        with telling(quiet or as_json) as told:
            answer = minimised(scene, comparison, names, smallest, told)
        document["minimised"] = answer.document
        status = answer.status or status
        if answer.status:
            click.echo(answer.sentence, err=True)
        elif not as_json and not quiet:
            click.echo(answer.sentence)
    if as_json:
        print_json(document)
    if out is not None:
        try:
            _write(comparison, document, out)
        except OSError as error:
            click.echo(f"--out: {out}: {error.strerror or error}", err=True)
            return 2
        if not quiet and not as_json:
            click.echo(f"written: {out}")
    return status


def _variants(path: str, overrides: Sequence[str], axes: Sequence[tuple[str, Sequence[Any]]]) -> list[Variant]:
    """Return the scene with each combination of swept values, the last sweep changing fastest.

    Raises:
        SceneError: the scene has faults, as it stands or with a value set.
        AddressError: there are too many combinations.
    """
    keys = [key for key, _ in axes]
    found: list[Variant] = []
    faults: dict[Fault, None] = {}
    failed = 0
    for point in combinations(axes):
        try:
            found.append(Variant(load(path, (*overrides, *point)), dict(point)))
        except SceneError as error:
            faults |= dict.fromkeys(relabelled(fault, keys) for fault in error.faults)
            failed += 1
            if failed == MAX_FAILED:
                break
    if faults:
        raise SceneError(tuple(faults))
    return found


def _write(comparison: Comparison, document: dict[str, object], out: Path) -> None:
    """Write the plots and the document into a folder, each to a temporary name first."""
    from sandbox.report.comparison import plot_comparison
    from sandbox.report.page.comparison_page import write_comparison

    plot_comparison(comparison, out)
    write_comparison(comparison, out / "report.html")
    write_json(document, out / "comparison.json")
