"""`sandbox engines`: who can compute scenes, a line each."""

import click

from sandbox.cli.reading import print_json
from sandbox.engines.registry import ENGINES


@click.command(name="engines")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
def command(as_json: bool) -> int:
    """List the engines and the physics that each models."""
    rows = [{"name": e.name, "about": e.about, "models": sorted(map(str, e.capabilities))} for e in ENGINES.values()]
    if as_json:
        print_json({"engines": rows})
        return 0
    for row in rows:
        click.echo(f"{row['name']}  {row['about']}; models {', '.join(row['models'])}")
    return 0
