"""A peer for billiards: full shots from the strike to rest, simulated and timed by pooltool.

    python -m tools.benchmarks.pooltool_shots [NAME…] [--corrected] [--repeats N] [--json]

The scenes in tools/benchmarks/shots have the tables, cushions, jaws, pockets, models and balls of pooltool, so that
another engine can simulate the same shot. Pooltool runs in a child process with its own home folder, under the Python
that `POOLTOOL_PYTHON` names, or this one, as it is installed, or `corrected` in the four ways of
`tools.oracles.pooltool_world`.
"""

import argparse
import atexit
import contextlib
import functools
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tools.benchmarks.clock import cpu_time

SHOTS = Path(__file__).resolve().parent / "shots"
NAMES = ("nine_ball_break", "eight_ball_break", "snooker_break", "three_cushions")
COMPARED = ("nine_ball_break", "eight_ball_break", "three_cushions")
"""Shots of which corrected pooltool has the same events, in the same order, as the engine `exact`."""


class Played(NamedTuple):
    """Result of a simulated shot."""

    seconds: float
    rest: float
    """time at which all balls are at rest, s"""
    events: list[list[Any]]
    """kind and names of the balls and cushions of each event, in the words of `ShotEvent`"""

    @property
    def ball_collisions(self) -> int:
        """Return the number of events that are collisions of two balls."""
        return sum(kind == "ball" for kind, _ in self.events)


KINDS = {
    "ball_ball": "ball",
    "ball_linear_cushion": "cushion",
    "ball_circular_cushion": "jaw",
    "ball_pocket": "pocket",
    "sliding_rolling": "rolls",
    "rolling_spinning": "spins",
    "rolling_stationary": "rests",
    "spinning_stationary": "rests",
}
"""pooltool's kinds of events, and those of `ShotEvent`."""


class MissingError(RuntimeError):
    """Pooltool is not available."""


def path(name: str) -> Path:
    """Return the scene file of a shot."""
    return SHOTS / f"{name}.toml"


def missing() -> str | None:
    """Return the reason why pooltool is not available, or None."""
    if "POOLTOOL_PYTHON" in os.environ or importlib.util.find_spec("pooltool"):
        return None
    return "pooltool-billiards is not installed here; POOLTOOL_PYTHON can name a Python that has it"


def peer(name: str, corrected: bool = False) -> Callable[[], float]:
    """Return a workload that simulates a shot with pooltool, from the strike to rest; setting up is not timed.

    Raises:
        MissingError: pooltool is not available.
    """
    player = playing(corrected)
    return lambda: player(name).seconds


@functools.cache
def playing(corrected: bool = False) -> "Player":
    """Start pooltool once, unchanged or corrected, and return its `Player`.

    Raises:
        MissingError: pooltool is not available.
    """
    return Player(corrected)


class Player:
    """Pooltool in a child process, which simulates shots by name."""

    def __init__(self, corrected: bool) -> None:
        if reason := missing():
            raise MissingError(reason)
        self.folder = tempfile.TemporaryDirectory(prefix="pooltool-")
        environment = {**os.environ, "HOME": self.folder.name}
        if corrected:  # keep compiled patched code apart from pooltool's own cache
            environment["NUMBA_CACHE_DIR"] = self.folder.name
        self.process = subprocess.Popen(
            [
                os.environ.get("POOLTOOL_PYTHON", sys.executable),
                *("-m", "tools.benchmarks.pooltool_shots", "--serve"),
                *["--corrected"] * corrected,
            ],
            cwd=Path(__file__).resolve().parents[2],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )
        atexit.register(self.close)

    def __call__(self, name: str) -> Played:
        """Simulate a shot.

        Raises:
            MissingError: pooltool has ended; the reason is on standard error.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        with contextlib.suppress(BrokenPipeError):  # reported below, as there is no answer
            self.process.stdin.write(f"{path(name)}\n")
            self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise MissingError(f"pooltool ended with status {self.process.wait()}")
        return Played(*json.loads(answer))

    def close(self) -> None:
        """End the process and remove its folder."""
        self.process.communicate()
        self.folder.cleanup()


def serve(corrected: bool) -> None:
    """Simulate the scene files named on standard input; answer each with a line."""
    answers, sys.stdout = sys.stdout, sys.stderr  # keeps prints of pooltool apart from the answers
    import pooltool as pt

    from tools.oracles import pooltool_world as world

    corrections = tuple(world.CORRECTIONS) if corrected else ()
    world.correct(corrections)
    for line in sys.stdin:
        document = tomllib.loads(Path(line.strip()).read_text())
        system, engine = world.system(document), world.engine(document, corrections)
        start_time = cpu_time()
        pt.simulate(system, engine=engine, inplace=True)
        seconds = cpu_time() - start_time
        order = list(system.balls)
        events = [
            (KINDS[kind], sorted(event.ids, key=order.index) if kind == "ball_ball" else list(event.ids))
            for event in system.events
            if (kind := str(event.event_type)) != "none"
        ]
        answers.write(json.dumps([seconds, float(system.t), events]) + "\n")
        answers.flush()


def measured(name: str, repeats: int, corrected: bool) -> dict[str, Any]:
    """Return median and minimum time of a shot after a warm-up, and its numbers of events."""
    play = playing(corrected)
    first = play(name)
    times = [play(name).seconds for _ in range(repeats)]
    return {
        "name": name,
        "median": statistics.median(times),
        "best": min(times),
        "unit": "s",
        "repeats": repeats,
        "events": len(first.events),
        "ball_ball": first.ball_collisions,
        "rest": first.rest,
    }


def main() -> int:
    """Time the named shots, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--corrected", action="store_true", help="correct the known faults of pooltool")
    parser.add_argument("--repeats", type=int, default=7, metavar="N")
    parser.add_argument("--json", action="store_true", help="one JSON document on standard output")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        serve(arguments.corrected)
        return 0
    if set(arguments.names) - set(NAMES) or arguments.repeats < 1:
        parser.error("a name that is not among the shots, or --repeats below 1")
    rows = []
    try:
        for name in arguments.names or NAMES:
            rows.append(measured(name, arguments.repeats, arguments.corrected))
            if not arguments.json:
                print(
                    "{name:18} median {median:.4g} s, best {best:.4g} s of {repeats}; "
                    "{events} events, {ball_ball} of two balls, at rest after {rest:.2f} s".format(**rows[-1])
                )
    except MissingError as error:
        print(error, file=sys.stderr)
        return 1
    if arguments.json:
        print(json.dumps({"rows": rows}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
