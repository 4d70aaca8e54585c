"""Breaks: until when a break of 16 balls on a floor can be trusted, played by pymunk in fixed steps.

    python -m tools.calibration.breaks [--seeds N] [--against ENGINE]

Each break is played at some dt, and either at 1/16 of it or by another engine. Printed is when a ball is first more
than 1 mm from where it is there, s after the first hit, up to 2 s: the least and the median over seeds, which move the
cue ball aside by up to 1 mm, for racks that touch and racks with gaps.
"""

import argparse
import math
import statistics
import sys
from datetime import UTC, datetime

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import start
from sandbox.provenance import machine, versions
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

RADIUS, MASS = 0.028575, 0.170097
WIDTH, LENGTH = 1.27, 2.54
TOO_FAR = 1e-3
"""m"""
FINER = 16
FIRST = 0.2
"""s, when the cue ball arrives, near enough"""
LOOK = 1 / 60
"""s between looks"""
LAST = 2.0
"""s, from the first hit on"""
SPEED = 6.0
"""m/s, of the cue ball"""
GAPS = (0.0, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2)
"""m"""
RATES = (60, 120, 240, 480, 960)
"""Hz"""


def rack(seed: int, gap: float, rate: int) -> Scene:
    """Return a break: 15 balls, and the cue ball that is about to hit them."""
    off = np.random.default_rng(seed).uniform(-1e-3, 1e-3)
    pitch = 2 * RADIUS + gap
    places = [(0.5 * WIDTH + off, 0.25 * LENGTH)]
    places += [
        (0.5 * WIDTH + (k - row / 2) * pitch, 0.75 * LENGTH + row * pitch * math.sqrt(0.75))
        for row in range(5)
        for k in range(row + 1)
    ]
    balls = [{"position": place, "radius": RADIUS, "mass": MASS, "material": "resin"} for place in places]
    rail = [[0, 0], [WIDTH, 0], [WIDTH, LENGTH], [0, LENGTH]]
    return from_document(
        {
            "world": {"duration": 10.0},
            "solver": {"dt": LOOK, "substeps": round(LOOK * rate)},
            "surface": {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.0127},
            "contact_models": {"ball_ball": "frictional", "cushion": "han2005"},
            "material": [{"name": "resin"}],
            "pair": [{"between": ["resin", "resin"], "restitution": 0.95}],
            "wall": [{"points": rail, "closed": True, "height": 1.28 * RADIUS, "restitution": 0.85, "friction": 0.2}],
            "ball": [{**balls[0], "velocity": [0.0, SPEED]}, *balls[1:]],
        }
    )


def path(scene: Scene, engine: str = "pymunk") -> FloatArray:
    """Return where all balls are at each look, (T, N, 2) m."""
    simulation, places = start(scene, engine), []
    for _ in range(round((FIRST + LAST) / LOOK)):
        simulation.step()
        places.append(simulation.frame().position)
    simulation.close()
    return np.asarray(places)


def parted(one: FloatArray, other: FloatArray) -> float:
    """Return when two paths are first too far apart, s; inf where they never are."""
    far = (np.hypot(*np.moveaxis(one - other, 2, 0)) > TOO_FAR).any(axis=1)
    return LOOK * (int(far.argmax()) + 1) - FIRST if far.any() else math.inf


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8, metavar="N")
    parser.add_argument("--against", metavar="ENGINE", help="instead of pymunk at a sixteenth of the step")
    arguments = parser.parse_args()
    print(f"{datetime.now(UTC):%Y-%m-%d}", *(f"{k} {v}" for k, v in {**machine(), **versions()}.items()), sep=" · ")
    for gap in GAPS:
        for rate in RATES:
            times = []
            for seed in range(arguments.seeds):
                other = rack(seed, gap, rate if arguments.against else rate * FINER)
                times.append(parted(path(rack(seed, gap, rate)), path(other, arguments.against or "pymunk")))
            least, median = min(times), statistics.median(times)
            print(f"gap {gap:5g} m, {rate:3} Hz: {least:.2f} s at least, {median:.2f} s in the median", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
