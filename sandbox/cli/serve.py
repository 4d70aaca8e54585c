"""Command `serve`: a live scene in the browser."""

import asyncio
import webbrowser
from dataclasses import dataclass
from functools import partial

import click

from sandbox.cli.common import collect_errors, engine_advice, exit_with_errors, scene_path
from sandbox.cli.options import set_option, takes
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import USUAL, UnknownEngineError, engine_named
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import load
from sandbox.scene.files.overrides import AddressError

NEEDS_AIOHTTP = "serve needs the `serve` extra: pip install -e '.[serve]'"


@dataclass(frozen=True, kw_only=True)
class ServeOptions:
    """Options of the command."""

    scene: str
    engine: str | None
    overrides: tuple[str, ...]
    sliders: tuple[str, ...]
    host: str
    port: int
    shared: bool
    max_viewers: int
    opens: bool


class AddressType(click.ParamType):  # type: ignore[type-arg]  # generic in newer versions of click alone
    """Address to listen at."""

    name = "address"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the address; an empty one, which would mean every network, is an error."""
        if not value.strip():
            self.fail("must be an address, such as 127.0.0.1, or 0.0.0.0 for all networks", param, ctx)
        return value.strip()


@click.command(name="serve")
@click.argument("scene")
@click.option("--engine", metavar="NAME", help="engine to start with; default: exact for billiards, otherwise pymunk")
@set_option()
@click.option(
    "--slider",
    "sliders",
    multiple=True,
    metavar="KEY[=LOW:HIGH]",
    help="number of the scene that gets a slider; default: gravity, dt, restitution, friction",
)
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="port; default: a free one")
@click.option(
    "--host",
    type=AddressType(),
    default="127.0.0.1",
    metavar="ADDRESS",
    help="address to listen at; default: this machine only. Others, such as 0.0.0.0, need the token that is printed",
)
@click.option("--shared", is_flag=True, help="one simulation for all viewers; default: one for each")
@click.option(
    "--max-viewers",
    type=click.IntRange(1, 1000),
    default=32,
    metavar="N",
    help="largest number of viewers; default: 32",
)
@click.option("--open", "opens", is_flag=True, help="open the page in a browser")
@takes(ServeOptions)
def serve_command(options: ServeOptions) -> int:
    """Serve a live scene to the browser: play, drag bodies, move sliders, change the engine.

    SCENE is a file or the name of a shipped scene. The command prints the address and runs until Ctrl-C.
    """
    try:
        from sandbox.interactive.server import SceneServer, ServerOptions
    except ModuleNotFoundError as error:
        if error.name != "aiohttp":
            raise
        click.echo(NEEDS_AIOHTTP, err=True)
        return 1
    from sandbox.interactive.live_scene import LiveScene

    faults: list[Fault] = []
    with collect_errors(faults, "--engine", (UnknownEngineError,)):
        engine_named(options.engine or USUAL)
    scene: Scene | None = None
    with collect_errors(faults):
        scene = load(scene_path(options.scene), options.overrides)
    if scene is None or faults:
        return exit_with_errors(faults)

    start = partial(LiveScene, scene, options.engine, options.sliders or None)
    try:
        with collect_errors(faults, "--slider", (AddressError,)):
            start().close()
    except Refusal as refusal:
        click.echo(f"{options.scene}: {refusal}{engine_advice(scene, options.engine is not None)}", err=True)
        return 1
    if faults:
        return exit_with_errors(faults)

    def say(address: str) -> None:
        click.echo(address)
        if options.opens:
            webbrowser.open(address)

    limits = ServerOptions(options.host, options.port, options.shared, options.max_viewers)
    try:
        asyncio.run(SceneServer(scene, start, limits).serve(say))
    except OSError as error:
        where = f"{options.host}:{options.port}"
        return exit_with_errors([Fault.of("--host", f"{where}: cannot be used: {error.strerror or error}")])
    return 0
