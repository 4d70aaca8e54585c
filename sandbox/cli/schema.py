"""`sandbox schema`: the JSON Schema of a scene file."""

import click

from sandbox.scene.schema import dumps


@click.command(name="schema")
@click.option("--json", is_flag=True, expose_value=False, help="as it is anyway: the schema is JSON")
def command() -> int:
    """Print the JSON Schema of a scene file, for editors."""
    click.echo(dumps(), nl=False)
    return 0
