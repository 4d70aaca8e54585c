"""`sandbox match`: frames of billiards between bots, without a window."""

from pathlib import Path
from typing import Any

import click

from sandbox.cli.naming import plural, with_other_engine
from sandbox.cli.output import make_folder, require_folder
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import UnknownEngineError, able, engine_named
from sandbox.games.billiards.bot.named import bots_in
from sandbox.games.billiards.frame import Frame, play
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.happening import GameError
from sandbox.games.billiards.rules.registry import RULES
from sandbox.scene.faults import Fault
from sandbox.scene.file import load
from sandbox.scene.model import Scene

TABLES = "8-ball, 9-ball, snooker or three-cushion"
"""Scenes to name where another is none."""


@click.command(name="match")
@click.argument("scene")
@click.option("--game", metavar="NAME", help=f"{', '.join(RULES)}; by default the scene's own")
@click.option("--players", default="bot,bot", metavar="A,B", help="bot or bot:SKILL, 0 to 1, each; one plays alone")
@click.option("--engine", default="exact", metavar="NAME", help="on which the balls roll; bots plan on exact")
@click.option("--seed", type=click.IntRange(0, 2**31), metavar="N", help="of the first frame; by default the scene's")
@click.option("--frames", type=click.IntRange(1, 100_000), default=1, metavar="N", help="each with the next seed")
@click.option("--distance", type=click.IntRange(1, 10_000), metavar="N", help="points to be made, in carom")
@click.option("--misses", is_flag=True, help="with the foul and a miss, in snooker")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="keep each frame as a session to replay")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="the result alone")
def command(
    scene: str,
    game: str | None,
    players: str,
    engine: str,
    seed: int | None,
    frames: int,
    distance: int | None,
    misses: bool,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Play frames of billiards between bots, and print the score.

    SCENE is a table: a file, or the name of a shipped one. Players take the first shot in turn.
    """
    faults: list[Fault] = []
    with gathering(faults, "--engine", (UnknownEngineError,)):
        engine_named(engine)
    count = 2
    with gathering(faults, "--players", (GameError,)):
        count = len(bots_in(players))
    found: list[Scene] = []
    terms: dict[str, Any] = ({} if distance is None else {"distance": distance}) | ({"misses": True} if misses else {})
    with gathering(faults):
        require_folder(out)
        path = path_of(scene)
        found = [load(path, overrides)]
        begin = found[0].world.seed if seed is None else seed
    if found and found[0].surface is None:
        faults.append(Fault(scene, None, "", f"is not a billiard table: it has no [surface]; such as {TABLES}"))
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
        click.echo(f"{scene}: {Refusal(engine, missing, able(found[0]))}{with_other_engine(found[0])}", err=True)
        return 1

    names, wins, rows, status = [each.strip() for each in players.split(",")], [0] * count, list[dict[str, Any]](), 0
    try:
        for k in range(frames):
            table = load(path, (*overrides, ("world.seed", begin + k)))
            # The first shot goes round: who sits at seat 0 of a frame breaks.
            seats = [(k + seat) % count for seat in range(count)]
            bots = bots_in(players, begin + k)
            frame = play(Match.begin(table, game, count, **terms), [bots[seat] for seat in seats], engine)
            won = frame.match.state.winner
            winner = None if won is None else seats[won]
            if winner is not None:
                wins[winner] += 1
            rows.append({**frame.document(), "seed": begin + k, "seats": seats, "winner": winner})
            if not frame.match.over:
                status = 1
                click.echo(f"frame {k + 1}: came to no end in {len(frame.turns)} turns", err=True)
            if out is not None:
                frame.session.save(out / f"frame-{k + 1}.json")
            if not quiet and not as_json:
                click.echo(_told(k + 1, frame, seats, names))
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(rows)} of {frames} frames are finished", err=True)
    if as_json:
        print_json({"scene": scene, "players": names, "wins": wins, "frames": rows})
    elif frames > 1 or quiet:
        each = ", ".join(
            f"player {n + 1} ({name}) {won}" for n, (name, won) in enumerate(zip(names, wins, strict=True))
        )
        drawn = len(rows) - sum(wins)
        click.echo(f"{len(rows)} frames: {each}" + (f", drawn {drawn}" if drawn else ""))
    return status


def _told(number: int, frame: Frame, seats: list[int], names: list[str]) -> str:
    """Return the line of a frame; scores are in the order in which the players are named."""
    state = frame.match.state
    ends = "no winner"
    if state.winner is not None:
        who = seats[state.winner]
        ends = f"player {who + 1} ({names[who]}) wins"
    scores = " : ".join(str(state.scores[seats.index(who)]) for who in range(len(seats)))
    shots = plural(len(frame.shots), "shot")
    fouls = plural(sum(bool(turn.fouls) for turn in frame.turns), "foul")
    return f"frame {number}: {ends}, {scores}; {shots}, {fouls}, {frame.session.duration:.0f} s"
