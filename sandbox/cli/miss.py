"""`sandbox miss`: by how much a shot misses, by engine, integrator and step."""

import math
import sys
from typing import TYPE_CHECKING, Any

import click

from sandbox.cli.reading import path_of, print_json, refused
from sandbox.cli.table import WIDE
from sandbox.cli.telling import telling
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load
from sandbox.scene.scene import Scene

if TYPE_CHECKING:
    from sandbox.games.artillery.landing_error import LandingErrorTable as MissTable


class Figure(click.FloatRange):
    """A range that nan is not in."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or tell that it is none."""
        number = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


STEP = Figure(min=1e-5, max=1.0)
SPEED = Figure(0.0, 1e6, min_open=True)
ANGLE = Figure(0.0, 180.0, min_open=True, max_open=True)


@click.command(name="miss")
@click.argument("scene")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--speed", type=SPEED, default=50.0, metavar="M/S", help="launch speed, m/s; default: 50")
@click.option(
    "--angle", type=ANGLE, default=45.0, metavar="DEG", help="launch angle above the horizontal, degrees; default: 45"
)
@click.option(
    "--dt",
    "dts",
    type=STEP,
    multiple=True,
    metavar="S",
    help="time step, s; may be repeated; default: 1/15, 1/60 and 1/240",
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
def command(
    scene: str, overrides: tuple[str, ...], speed: float, angle: float, dts: tuple[float, ...], as_json: bool
) -> int:
    """Compute the flight of a projectile over level ground on every engine, and print the error of each landing point.

    Gravity, drag and wind are those of SCENE, a file or the name of a shipped scene.
    """
    from sandbox.games.artillery.landing_error import (  # the engines, which help needs none of
        STEPS,
        landing_error_table,
    )

    try:
        read = load(path_of(scene), overrides)
        with telling(as_json) as told:
            found = landing_error_table(read.world, speed, math.radians(angle), dts or STEPS, told)
    except SceneError as error:
        return refused(error.faults, as_json, scene=scene)
    except ValueError as error:
        falls = read.world.gravity[1] < 0.0
        return refused([Fault(scene, None, "" if falls else "world.gravity", str(error))], as_json, scene=scene)
    if as_json:
        rows = [row._asdict() for row in found.rows]
        refusals = [{"engine": engine, "reason": reason} for engine, reason in found.refused]
        truth = {"range": found.range, "time": found.time}
        print_json({"scene": scene, **truth, "rows": rows, "refused": refusals, "interrupted": found.interrupted})
    else:
        _print(scene, read, found, f"{speed:g} m/s at {angle:g}°")
    if found.interrupted:
        click.echo(f"interrupted: {len(found.rows)} flights are complete and kept", err=True)
    return 130 if found.interrupted else 0


def _print(name: str, scene: Scene, found: "MissTable", shot: str) -> None:
    """Print a row an engine and integrator, and a column a step."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from sandbox.games.artillery.shells import format_deviation

    world = scene.world
    air = f"drag {world.linear_drag:g} 1/s and {world.quadratic_drag:g} 1/m, wind {world.wind[0]:g} m/s"
    truth = f"{shot}, {air}: exact range {found.range:.4f} m, time of flight {found.time:.5f} s"
    click.echo(f"{name}: {truth}")
    dts = list(dict.fromkeys(row.dt for row in found.rows))
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("engine", no_wrap=True)
    table.add_column("integrator", no_wrap=True)
    for dt in dts:
        table.add_column(f"dt {dt:.4g} s", justify="right", no_wrap=True)
    for engine, integrator in dict.fromkeys((row.engine, row.integrator) for row in found.rows):
        those = {row.dt: row.off for row in found.rows if (row.engine, row.integrator) == (engine, integrator)}
        cells = [f"{'+' if those[dt] >= 0 else '−'}{format_deviation(abs(those[dt]))}" for dt in dts if dt in those]
        table.add_row(engine, integrator or "", *(cell if cell[1:2] != "l" else cell[1:] for cell in cells))
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.print(table)
    for engine, reason in found.refused:
        console.print(Text(f"{engine}: {reason}"), soft_wrap=True)
