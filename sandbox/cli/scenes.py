"""`sandbox scenes`: what ships, a line each."""

import tomllib

import click

from sandbox.cli.reading import print_json
from sandbox.scene.files.shipped_scenes import shipped


@click.command(name="scenes")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
def command(as_json: bool) -> int:
    """List the shipped scenes: name, title, and what to observe."""
    rows = []
    for scene in shipped():
        document = tomllib.loads(scene.path.read_text(encoding="utf-8"))
        rows.append({"name": scene.name, "title": document["title"], "about": document["about"]})
    if as_json:
        print_json({"scenes": rows})
        return 0
    width = max((len(row["name"]) for row in rows), default=0)
    for row in rows:
        click.echo(f"{row['name']:<{width}}  {row['title']}. {row['about']}")
    return 0
