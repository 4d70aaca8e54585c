"""`sandbox schema`: the JSON Schema of a scene file."""

import click

from sandbox.scene.schema import dumps


@click.command(name="schema")
def command() -> int:
    """Print the JSON Schema of a scene file, for editors."""
    click.echo(dumps(), nl=False)
    return 0
