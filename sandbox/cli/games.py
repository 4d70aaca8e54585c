"""Commands `match` and `miss`."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import click
from click.core import ParameterSource
from pydantic import TypeAdapter

from sandbox.cli.common import (
    collect_errors,
    engine_advice,
    exit_with_errors,
    make_folder,
    require_folder,
    scene_path,
)
from sandbox.cli.options import (
    POSITIVE,
    FiniteRange,
    OutputOptions,
    json_option,
    out_option,
    quiet_option,
    set_option,
    takes,
)
from sandbox.cli.progress import status_line
from sandbox.cli.streams import print_json
from sandbox.cli.tables import add_columns, new_table, print_line, print_table
from sandbox.echo import MAX_NAMED, shorten
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import UnknownEngineError, able, engine_named
from sandbox.formatting import format_plural
from sandbox.games.billiards.bot import parse_bots
from sandbox.games.billiards.headless import MAX_TURNS, FrameRecord, FrameTurn, play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.registry import RULESETS
from sandbox.jsonable import in_json, to_json
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load
from sandbox.signals import reraise_interrupt

if TYPE_CHECKING:
    from sandbox.measure.landing_error import LandingErrorTable


TABLES = "8-ball, 9-ball, snooker, three-cushion, …"
"""Scenes that a message names as examples of tables."""

_TURNS = TypeAdapter(tuple[FrameTurn, ...])


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line of `match` as typed; None for an option that was left out."""

    scene: str
    game: str | None
    players: str
    engine: str
    seed: int | None
    frames: int
    turns: int
    time_limit: float | None
    distance: int | None
    misses: bool
    overrides: tuple[str, ...]
    out: Path | None

    @property
    def names(self) -> list[str]:
        """Names of the players as given."""
        return [name.strip() for name in self.players.split(",")]

    @property
    def terms(self) -> dict[str, Any]:
        """Terms of the game."""
        distance = {} if self.distance is None else {"distance": self.distance}
        return distance | ({"misses": True} if self.misses else {})


@dataclass(frozen=True, kw_only=True)
class MatchFrame:
    """A frame of a match."""

    game: str
    winner: int | None
    """player"""
    over: bool
    unfinished: str | None
    """reason why the frame was abandoned"""
    scores: Sequence[int]
    """by seat"""
    shots: int
    duration: float
    """s"""
    state_hash: str | None
    turns: Sequence[Mapping[str, object]]
    """every decision and shot, without default values"""
    seed: int
    seats: tuple[int, ...]
    """player at each seat; seat 0 breaks"""

    @classmethod
    def of(cls, frame: FrameRecord, seed: int, seats: Sequence[int]) -> "MatchFrame":
        """Return a played frame."""
        state = frame.match.state
        turns: list[dict[str, object]] = _TURNS.dump_python(frame.turns, mode="json", exclude_defaults=True)
        return cls(
            game=frame.match.rules.name,
            winner=None if state.winner is None else seats[state.winner],
            over=state.over,
            unfinished=frame.unfinished,
            scores=state.scores,
            shots=len(frame.shots),
            duration=frame.session.duration,
            state_hash=frame.session.state_hash,
            turns=turns,
            seed=seed,
            seats=tuple(seats),
        )


@dataclass
class MatchResult:
    """Frames played so far; the JSON document of `match`."""

    scene: str
    players: Sequence[str]
    """as the user named them"""
    frames: list[MatchFrame] = field(default_factory=list)
    """complete frames"""
    status: int = field(default=0, metadata=in_json(omit=True))
    """exit status: 1 a frame was abandoned, 2 a session cannot be saved, 130 interrupted"""

    json_head: ClassVar = ("scene", "players", "wins", "unfinished")
    json_properties: ClassVar = ("interrupted",)

    @property
    def wins(self) -> Sequence[int]:
        """Number of frames that each player won."""
        return [sum(each.winner == player for each in self.frames) for player in range(len(self.players))]

    @property
    def unfinished(self) -> int:
        """Number of abandoned frames."""
        return sum(each.unfinished is not None for each in self.frames)

    @property
    def interrupted(self) -> bool:
        """Whether an interrupt ended the match early."""
        return self.status == 130

    def text(self) -> str:
        """Return the result of all frames as one line."""
        players = enumerate(zip(self.players, self.wins, strict=True), 1)
        wins_text = ", ".join(f"player {number} ({name}) {won}" for number, (name, won) in players)
        drawn = len(self.frames) - sum(self.wins) - self.unfinished
        counts = ((drawn, "drawn"), (self.unfinished, "abandoned"))
        other_counts = "".join(f", {outcome} {count}" for count, outcome in counts if count)
        return f"{len(self.frames)} frames: {wins_text}{other_counts}"


@click.command(name="match")
@click.argument("scene")
@click.option("--game", metavar="NAME", help=f"{', '.join(RULESETS)}; default: the game of the scene")
@click.option(
    "--players",
    default="bot,bot",
    metavar="A,B",
    help="players: bot or bot:SKILL each, SKILL 0 to 1; one player plays alone",
)
@click.option(
    "--engine",
    default="exact",
    metavar="NAME",
    help="engine that runs the shots; default: exact. Bots always plan on exact",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31),
    metavar="N",
    help="random seed of the first frame; default: the seed of the scene",
)
@click.option(
    "--frames",
    type=click.IntRange(1, 100_000),
    default=1,
    metavar="N",
    help="number of frames; each uses the next seed; default: 1",
)
@click.option(
    "--turns",
    type=click.IntRange(1, 1_000_000),
    default=MAX_TURNS,
    metavar="N",
    help=f"abandon a frame after N shots and decisions; default: {MAX_TURNS:,}",
)
@click.option(
    "--time-limit",
    type=POSITIVE,
    metavar="S",
    help="abandon a frame after S seconds, so results depend on the machine; default: no limit",
)
@click.option("--distance", type=click.IntRange(1, 10_000), metavar="N", help="points to win a game of carom")
@click.option("--misses", is_flag=True, help="apply the foul-and-a-miss rule of snooker")
@set_option()
@out_option("store each frame as a session for `sandbox replay`")
@json_option
@quiet_option("print the final result only")
@takes(_Options)
def match_command(options: _Options) -> int:
    """Play frames of billiards between bots, and print the score.

    SCENE is a billiard table: a file or the name of a shipped scene. Players break in turn. Exit status 1: a frame was
    abandoned because of --turns or --time-limit, or because a shot did not come to rest.
    """
    faults: list[Fault] = []
    scene = _table(options, faults)
    if faults or scene is None:
        return exit_with_errors(faults, options.as_json, frames=[])
    missing = engine_named(options.engine).missing(scene, scene.solver)
    if missing:
        is_chosen = click.get_current_context().get_parameter_source("engine") is ParameterSource.COMMANDLINE
        advice = engine_advice(scene, is_chosen)
        click.echo(f"{options.scene}: {Refusal(options.engine, missing, able(scene))}{advice}", err=True)
        return 1
    result = MatchResult(options.scene, options.names)
    try:
        _play_frames(options, scene.world.seed if options.seed is None else options.seed, result)
    except KeyboardInterrupt:
        result.status = 130
        click.echo(f"interrupted: {len(result.frames):,} of {options.frames:,} frames are complete", err=True)
    if options.as_json:
        print_json(to_json(result))
    elif options.frames > 1 or options.quiet:
        click.echo(result.text())
    return result.status


def _table(options: _Options, faults: list[Fault]) -> Scene | None:
    """Return the scene; add the errors of the command line to the faults."""
    with collect_errors(faults, "--engine", (UnknownEngineError,)):
        engine_named(options.engine)
    if options.time_limit is not None and math.isnan(options.time_limit):
        faults.append(Fault.of("--time-limit", "is not a number; it must be greater than 0"))
    count = 2
    with collect_errors(faults, "--players", (GameError,)):
        count = len(parse_bots(options.players))
    scene: Scene | None = None
    with collect_errors(faults):
        require_folder(options.out)
        scene = load(scene_path(options.scene), options.overrides)
    if scene is not None and scene.surface is None:
        faults.append(Fault.of(options.scene, f"is not a billiard table: it has no [surface]; tables are {TABLES}"))
    elif scene is not None:
        with collect_errors(faults, options.scene, (GameError,)):
            Match.begin(scene, options.game, count, **options.terms)
    if not faults and options.out is not None:
        with collect_errors(faults):
            make_folder(options.out)
    return scene


def _play_frames(options: _Options, first_seed: int, result: MatchResult) -> None:
    """Play all frames, and add each to the result when it ends."""
    path, count = scene_path(options.scene), len(options.names)
    for k in range(options.frames):
        table = load(path, (*options.overrides, ("world.seed", first_seed + k)))
        seats = [(k + seat) % count for seat in range(count)]  # seat 0 breaks, so players break in turn
        bots = parse_bots(options.players, first_seed + k)
        with status_line(options.is_silent) as progress:
            frame = reraise_interrupt()(play_frame)(
                Match.begin(table, options.game, count, **options.terms),
                [bots[seat] for seat in seats],
                options.engine,
                most=options.turns,
                time_limit=options.time_limit,
                on_turn=None if progress is None else _turn_progress(progress, k + 1, options.frames, seats),
            )
        result.frames.append(MatchFrame.of(frame, first_seed + k, seats))
        if frame.unfinished is not None:
            result.status = 1
            click.echo(f"frame {k + 1}: abandoned: {frame.unfinished}", err=True)
        try:
            if options.out is not None:
                frame.session.save(options.out / f"frame-{k + 1}.json")
        except OSError as error:
            click.echo(f"--out: {shorten(str(options.out), MAX_NAMED)}: {error.strerror or error}", err=True)
            result.status = 2
            return
        if not options.is_silent:
            click.echo(_frame_line(k + 1, frame, seats, options.names))


def _turn_progress(
    progress: ProgressCallback, number: int, frames: int, seats: list[int]
) -> Callable[[FrameTurn, Match], None]:
    """Return a callback that shows the progress of a frame after each turn."""
    done = 0

    def after(_: FrameTurn, match: Match) -> None:
        nonlocal done
        done += 1
        progress(Progress(f"frame {number:,} of {frames:,}: {format_plural(done, 'turn')}, {_scores(match, seats)}"))

    return after


def _scores(match: Match, seats: list[int]) -> str:
    """Return the scores in the order in which the players are named."""
    return " : ".join(str(match.state.scores[seats.index(player)]) for player in range(len(seats)))


def _frame_line(number: int, frame: FrameRecord, seats: list[int], names: list[str]) -> str:
    """Return the result of a frame as one line; scores are in the order in which the players are named."""
    state = frame.match.state
    result = "no winner" if frame.unfinished is None else "abandoned"
    if state.winner is not None:
        player = seats[state.winner]
        result = f"player {player + 1} ({names[player]}) wins"
    scores = _scores(frame.match, seats)
    shots = format_plural(len(frame.shots), "shot")
    fouls = format_plural(sum(bool(turn.fouls) for turn in frame.turns), "foul")
    return f"frame {number}: {result}, {scores}; {shots}, {fouls}, {frame.session.duration:.0f} s"


STEP = FiniteRange(min=1e-5, max=1.0)
SPEED = FiniteRange(0.0, 1e6, min_open=True)
ANGLE = FiniteRange(0.0, 180.0, min_open=True, max_open=True)


@click.command(name="miss")
@click.argument("scene")
@set_option()
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
@json_option
def miss_command(
    scene: str, overrides: tuple[str, ...], speed: float, angle: float, dts: tuple[float, ...], as_json: bool
) -> int:
    """Compute the flight of a projectile over level ground on every engine, and print the error of each landing point.

    Gravity, drag and wind are those of SCENE, a file or the name of a shipped scene.
    """
    from sandbox.measure.landing_error import STEPS, landing_error_table  # imports the engines

    try:
        read = load(scene_path(scene), overrides)
        with status_line(as_json) as progress:
            found = landing_error_table(read.world, speed, math.radians(angle), dts or STEPS, progress)
    except SceneError as error:
        return exit_with_errors(error.faults, as_json, scene=scene)
    except ValueError as error:
        falls = read.world.gravity[1] < 0.0
        return exit_with_errors(
            [Fault(scene, None, "" if falls else "world.gravity", str(error))], as_json, scene=scene
        )
    if as_json:
        print_json({"scene": scene, **to_json(found)})
    else:
        _print_landing_errors(scene, read, found, f"{speed:g} m/s at {angle:g}°")
    if found.interrupted:
        click.echo(f"interrupted: {len(found.rows)} flights are complete and kept", err=True)
    return 130 if found.interrupted else 0


def _print_landing_errors(name: str, scene: Scene, found: "LandingErrorTable", shot: str) -> None:
    """Print a table with a line for each engine and integrator, and a column for each step."""
    from sandbox.games.artillery.shells import format_deviation

    world = scene.world
    air = f"drag {world.linear_drag:g} 1/s and {world.quadratic_drag:g} 1/m, wind {world.wind[0]:g} m/s"
    if world.has_damping:
        air += f", damping {world.damping:g}"
    truth = f"{shot}, {air}: exact range {found.range:.4f} m, time of flight {found.time:.5f} s"
    click.echo(f"{name}: {truth}")
    dts = list(dict.fromkeys(row.dt for row in found.rows))
    table = new_table()
    add_columns(table, ("engine", "integrator"))
    add_columns(table, (f"dt {dt:.4g} s" for dt in dts), "right")
    for engine, integrator in dict.fromkeys((row.engine, row.integrator) for row in found.rows):
        errors = {row.dt: row.range_error for row in found.rows if (row.engine, row.integrator) == (engine, integrator)}
        cells = [f"{'+' if errors[dt] >= 0 else '−'}{format_deviation(abs(errors[dt]))}" for dt in dts if dt in errors]
        # A deviation below the resolution is "less than …", without a sign.
        table.add_row(engine, integrator or "", *(cell[1:] if cell[1:2] == "l" else cell for cell in cells))
    print_table(table)
    for engine, reason in found.refused:
        print_line(f"{engine}: {reason}")
