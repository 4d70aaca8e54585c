"""`sandbox compare`: one scene on several engines, scored against the best known truth."""

from pathlib import Path

import click

from sandbox.cli.comparison_table import print_comparison
from sandbox.cli.minimising import faults_of, minimised
from sandbox.cli.naming import engines_in
from sandbox.cli.output import make_folder, require_folder, write_json
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.cli.telling import telling
from sandbox.measure.compare import Comparison, compare
from sandbox.measure.recorder import TooLargeError
from sandbox.scene.faults import Fault
from sandbox.scene.file import load
from sandbox.scene.model import Scene


@click.command(name="compare")
@click.argument("scene")
@click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help="which engine(s); by default all")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="M",
    help="position error that is too much, m; by default 1 % of the smallest ball's radius",
)
@click.option("--why", is_flag=True, help="rerun with other settings, one and two at a time; say which lower the error")
@click.option(
    "--minimise",
    is_flag=False,
    flag_value="",
    metavar="[FILE]",
    help="leave out bodies while two engines, or one and the truth, still part, and write the smallest scene; "
    "by default SCENE.min.toml here",
)
@click.option("--force", is_flag=True, help="let --minimise replace a file that exists")
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR", help="write report.html, plots and comparison.json"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="no table, no progress")
def command(
    scene: str,
    engines: str | None,
    overrides: tuple[str, ...],
    tolerance: float | None,
    why: bool,
    out: Path | None,
    minimise: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Run a scene on several engines and score each against the best known truth. SCENE is a file or a shipped one."""
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    read: Scene | None = None
    path = ""
    with gathering(faults):
        path = path_of(scene)
        read = load(path, overrides)
    with gathering(faults, "--tolerance", (ValueError,)):
        if tolerance == float("inf") or tolerance != tolerance:
            raise ValueError(f"{tolerance} m; a tolerance is finite")
    with gathering(faults):
        require_folder(out)

    smallest = None if minimise is None else Path(minimise or f"{Path(path or scene).stem}.min.toml")
    if smallest is not None:
        faults += faults_of(smallest, path, force)
    elif force:
        faults.append(Fault("--force", None, "", "is of --minimise; there is nothing else to replace"))

    if out is not None and not faults:
        with gathering(faults):
            make_folder(out)
    comparison: Comparison | None = None
    if read is not None and not faults:
        with gathering(faults, scene, (TooLargeError,)), telling(quiet or as_json) as told:
            comparison = compare(read, names, tolerance=tolerance, why=why, told=told)
    if comparison is None:
        return refused(faults, as_json, scene=scene, truth=None, engines=[])

    status = 0
    for row in comparison.rows:
        if row.status != "ok" and (row.status != "refused" or names is not None):
            status = 1
            what = row.reason if row.status == "refused" else f"{row.engine} {row.status}: {row.reason}"
            click.echo(f"{scene}: {what}", err=True)
    document = comparison.document(scene)
    if not as_json and not quiet:
        print_comparison(scene, comparison, why, refusals=names is None)
    if smallest is not None:
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


def _write(comparison: Comparison, document: dict[str, object], out: Path) -> None:
    """Write the plots and the document into a folder, each to a temporary name first."""
    from sandbox.report.comparison import plot_comparison
    from sandbox.report.page.comparison_page import write_comparison

    plot_comparison(comparison, out)
    write_comparison(comparison, out / "report.html")
    write_json(document, out / "comparison.json")
