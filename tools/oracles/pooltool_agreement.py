"""Compare shots of `exact` with pooltool as it is installed and with four corrections: distances, events, and speed.

    POOLTOOL_PYTHON=PYTHON-WITH-POOLTOOL python -m tools.oracles.pooltool_agreement [--json] [--repeats N]

Each of the shots in tests/engines/exact/tabletop/cases is simulated by `sandbox.run` on `exact` and by pooltool in
several processes: as installed, with all corrections of pooltool_world.py, and with all but one. Distances are those of
ball centres at the frames of the case, up to the time to which the case is trusted. Then come the rows of the
benchmarks that time a 9-ball break.
"""

import argparse
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

CASES = Path(__file__).resolve().parents[2] / "tests" / "engines" / "exact" / "tabletop" / "cases"
SPEED_ROWS = (
    "shot-nine-ball-break",
    "shot-nine-ball-break-arrays",
    "shot-nine-ball-break-batch",
    "run-break",
    "shot-nine-ball-break-installed",
)
LIMITS = (1e-8, 1e-5)
"""m; shots within these distances are counted."""


PHASES = {
    "ball_ball": "ball",
    "slide_roll": "rolls",
    "roll_spin": "spins",
    "roll_stop": "rests",
    "spin_stop": "rests",
}
"""Kinds of billiards.py, and those of `ShotEvent`."""


class Agreement(NamedTuple):
    """Distances of all shots from those of one pooltool."""

    label: str
    distance: dict[str, float]
    """largest distance of a ball by shot, m"""
    same_events: dict[str, bool]
    """by shot, whether kinds, balls and cushions of all events are the same, in order"""


def serve(corrections: list[str]) -> None:
    """Simulate all cases with pooltool and these corrections; print positions and events as JSON."""
    answers, sys.stdout = sys.stdout, sys.stderr  # keeps prints of pooltool apart from the answer
    from tools.oracles import billiards
    from tools.oracles.audit import Rules

    found = {}
    for path in sorted(CASES.glob("*.toml")):
        document, stored = tomllib.loads(path.read_text()), json.loads(path.with_suffix(".json").read_text())
        events = billiards.simulated(document, corrections=corrections)
        states = billiards.sampled(Rules(document), events, stored["times"])
        found[path.stem] = {
            "position": states[:, :, 0, :2].tolist(),
            "events": [[PHASES.get(e.kind, e.kind), *e.names] for e in events[1:] if e.time <= stored["trusted_until"]],
        }
    json.dump(found, answers)


def compared(label: str, corrections: list[str]) -> Agreement:
    """Return the agreement of all cases with pooltool in another process.

    Raises:
        CalledProcessError: pooltool has failed; the reason is on standard error.
    """
    from sandbox.measure.run.runner import run
    from sandbox.scene.files.load import load

    python = os.environ.get("POOLTOOL_PYTHON", sys.executable)
    line = [python, "-m", "tools.oracles.pooltool_agreement", "--serve", ",".join(corrections)]
    root = Path(__file__).resolve().parents[2]
    answer = subprocess.run(line, cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout
    distance, same_events = {}, {}
    for name, theirs in json.loads(answer).items():
        scene, stored = load(CASES / f"{name}.toml"), json.loads((CASES / f"{name}.json").read_text())
        ours = run(scene, "exact").position[stored["frames"]]
        distance[name] = float(np.linalg.norm(ours - np.array(theirs["position"]), axis=2).max())
        same_events[name] = theirs["events"] == _events(scene, stored["trusted_until"])
    return Agreement(label, distance, same_events)


def _events(scene: Any, until: float) -> list[list[str]]:
    """Return the events of a shot on `exact` up to a time, s."""
    import sandbox

    return [
        ["cushion" if event.kind == "jaw" else event.kind, *(n for n in (event.ball, event.partner) if n is not None)]
        for event in sandbox.Table(scene).shoot(until=until).events
    ]


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON document on standard output")
    parser.add_argument("--repeats", type=int, default=15, metavar="N", help="repeats of the timings; 0 for none")
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve is not None:
        serve([each for each in arguments.serve.split(",") if each])
        return 0
    from tools.benchmarks import pooltool_shots

    if reason := pooltool_shots.missing():
        print(reason, file=sys.stderr)
        return 1
    names = ("spacer", "friction", "touching", "quadratic")
    rows = [
        compared("as installed", []),
        compared("with four corrections", list(names)),
        *(compared(f"without {name}", [other for other in names if other != name]) for name in names),
    ]
    if arguments.json:
        print(json.dumps([row._asdict() for row in rows]))
        return 0
    heading = f"pooltool, {len(rows[0].distance)} shots"
    print(f"{heading:24}{'within 1e-8 m':>16}{'within 1e-5 m':>16}{'worst, m':>12}  events equal")
    for row in rows:
        within = [sum(distance <= limit for distance in row.distance.values()) for limit in LIMITS]
        worst = max(row.distance, key=row.distance.__getitem__)
        print(
            f"{row.label:24}{within[0]:>16}{within[1]:>16}{row.distance[worst]:>12.2g}  "
            f"{sum(row.same_events.values())} ({worst} is worst)"
        )
    if arguments.repeats:
        root = Path(__file__).resolve().parents[2]
        line = [sys.executable, "tools/bench.py", *SPEED_ROWS, "--repeats", str(arguments.repeats)]
        return subprocess.run(line, cwd=root).returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
