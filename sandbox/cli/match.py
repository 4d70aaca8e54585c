"""`sandbox match`: frames of billiards between bots, without a window."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from sandbox.cli.naming import plural, with_other_engine
from sandbox.cli.output import make_folder, require_folder
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.cli.telling import telling
from sandbox.echo import MAX_NAMED, shorten
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import UnknownEngineError, able, engine_named
from sandbox.games.billiards.bot import parse_bots
from sandbox.games.billiards.headless import MAX_TURNS, FrameRecord, FrameTurn, play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.registry import RULESETS
from sandbox.interrupt import heeded
from sandbox.measure.told import Told
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import load
from sandbox.scene.scene import Scene

TABLES = "8-ball, 9-ball, snooker, three-cushion, …"
"""Scenes to name where another is none."""


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
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="S",
    help="abandon a frame after S seconds, so results depend on the machine; default: no limit",
)
@click.option("--distance", type=click.IntRange(1, 10_000), metavar="N", help="points to win a game of carom")
@click.option("--misses", is_flag=True, help="apply the foul-and-a-miss rule of snooker")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR", help="store each frame as a session for `sandbox replay`"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="print the final result only")
def command(
    scene: str,
    game: str | None,
    players: str,
    engine: str,
    seed: int | None,
    frames: int,
    turns: int,
    time_limit: float | None,
    distance: int | None,
    misses: bool,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Play frames of billiards between bots, and print the score.

    SCENE is a billiard table: a file or the name of a shipped scene. Players break in turn. Exit status 1: a frame was
    abandoned because of --turns or --time-limit, or because a shot did not come to rest.
    """
    faults: list[Fault] = []
    with gathering(faults, "--engine", (UnknownEngineError,)):
        engine_named(engine)
    if time_limit is not None and math.isnan(time_limit):
        faults.append(Fault("--time-limit", None, "", "is not a number; it must be greater than 0"))
    count = 2
    with gathering(faults, "--players", (GameError,)):
        count = len(parse_bots(players))
    found: list[Scene] = []
    terms: dict[str, Any] = ({} if distance is None else {"distance": distance}) | ({"misses": True} if misses else {})
    with gathering(faults):
        require_folder(out)
        path = path_of(scene)
        found = [load(path, overrides)]
        begin = found[0].world.seed if seed is None else seed
    if found and found[0].surface is None:
        faults.append(Fault(scene, None, "", f"is not a billiard table: it has no [surface]; tables are {TABLES}"))
    elif found:
        with gathering(faults, scene, (GameError,)):
            Match.begin(found[0], game, count, **terms)
    if not faults and out is not None:
        with gathering(faults):
            make_folder(out)
    if faults:
        return refused(faults, as_json, frames=[])
    missing = engine_named(engine).missing(found[0], found[0].solver)
    if missing:
        is_chosen = click.get_current_context().get_parameter_source("engine") is ParameterSource.COMMANDLINE
        advice = with_other_engine(found[0], is_chosen)
        click.echo(f"{scene}: {Refusal(engine, missing, able(found[0]))}{advice}", err=True)
        return 1

    names, wins, rows, status = [each.strip() for each in players.split(",")], [0] * count, list[dict[str, Any]](), 0
    try:
        for k in range(frames):
            table = load(path, (*overrides, ("world.seed", begin + k)))
            # The first shot goes round: who sits at seat 0 of a frame breaks.
            seats = [(k + seat) % count for seat in range(count)]
            bots = parse_bots(players, begin + k)
            with telling(quiet or as_json) as told:
                frame = heeded()(play_frame)(
                    Match.begin(table, game, count, **terms),
                    [bots[seat] for seat in seats],
                    engine,
                    most=turns,
                    time_limit=time_limit,
                    told=None if told is None else _progress(told, k + 1, frames, seats),
                )
            won = frame.match.state.winner
            winner = None if won is None else seats[won]
            if winner is not None:
                wins[winner] += 1
            rows.append({**frame.document(), "seed": begin + k, "seats": seats, "winner": winner})
            if frame.unfinished is not None:
                status = 1
                click.echo(f"frame {k + 1}: abandoned: {frame.unfinished}", err=True)
            try:
                if out is not None:
                    frame.session.save(out / f"frame-{k + 1}.json")
            except OSError as error:
                click.echo(f"--out: {shorten(str(out), MAX_NAMED)}: {error.strerror or error}", err=True)
                status = 2
                break
            if not quiet and not as_json:
                click.echo(_told(k + 1, frame, seats, names))
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(rows):,} of {frames:,} frames are complete", err=True)
    unfinished = sum(row["unfinished"] is not None for row in rows)
    if as_json:
        played = {"wins": wins, "unfinished": unfinished, "frames": rows, "interrupted": status == 130}
        print_json({"scene": scene, "players": names, **played})
    elif frames > 1 or quiet:
        each = ", ".join(
            f"player {n + 1} ({name}) {won}" for n, (name, won) in enumerate(zip(names, wins, strict=True))
        )
        drawn = len(rows) - sum(wins) - unfinished
        counts = ((drawn, "drawn"), (unfinished, "abandoned"))
        rest = "".join(f", {what} {number}" for number, what in counts if number)
        click.echo(f"{len(rows)} frames: {each}{rest}")
    return status


def _progress(told: Told, number: int, frames: int, seats: list[int]) -> Callable[[FrameTurn, Match], None]:
    """Return what says after each turn how far a frame is."""
    done = 0

    def after(_: FrameTurn, match: Match) -> None:
        nonlocal done
        done += 1
        told(f"frame {number:,} of {frames:,}: {plural(done, 'turn')}, {_scores(match, seats)}")

    return after


def _scores(match: Match, seats: list[int]) -> str:
    """Return the scores in the order in which the players are named."""
    return " : ".join(str(match.state.scores[seats.index(who)]) for who in range(len(seats)))


def _told(number: int, frame: FrameRecord, seats: list[int], names: list[str]) -> str:
    """Return the line of a frame; scores are in the order in which the players are named."""
    state = frame.match.state
    ends = "no winner" if frame.unfinished is None else "abandoned"
    if state.winner is not None:
        who = seats[state.winner]
        ends = f"player {who + 1} ({names[who]}) wins"
    scores = _scores(frame.match, seats)
    shots = plural(len(frame.shots), "shot")
    fouls = plural(sum(bool(turn.fouls) for turn in frame.turns), "foul")
    return f"frame {number}: {ends}, {scores}; {shots}, {fouls}, {frame.session.duration:.0f} s"
