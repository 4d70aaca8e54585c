"""Breaks: the time until which a break of 16 balls on a surface, simulated by pymunk in fixed steps, can be trusted.

    python -m tools.calibration.breaks [--seeds N] [--against ENGINE]

Each break is simulated with some dt, and again with 1/16 of it or on another engine. The result is the time after the
first hit, up to 2 s, at which a ball first differs by more than 1 mm: minimum and median over seeds, which shift the
cue ball by up to 1 mm, for racks of touching balls and racks with gaps.
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
MAX_DISTANCE = 1e-3
"""m; two simulations agree up to this distance"""
REFINEMENT = 16
FIRST_HIT = 0.2
"""s, approximate time of the first hit"""
FRAME = 1 / 60
"""s between compared frames"""
LAST = 2.0
"""s after the first hit, end of the comparison"""
SPEED = 6.0
"""m/s, speed of the cue ball"""
GAPS = (0.0, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2)
"""m"""
RATES = (60, 120, 240, 480, 960)
"""Hz"""


def rack(seed: int, gap: float, rate: int) -> Scene:
    """Return a break: a rack of 15 balls, and a cue ball that moves towards it."""
    off = np.random.default_rng(seed).uniform(-1e-3, 1e-3)
    pitch = 2 * RADIUS + gap
    positions = [(0.5 * WIDTH + off, 0.25 * LENGTH)]
    positions += [
        (0.5 * WIDTH + (k - row / 2) * pitch, 0.75 * LENGTH + row * pitch * math.sqrt(0.75))
        for row in range(5)
        for k in range(row + 1)
    ]
    balls = [{"position": position, "radius": RADIUS, "mass": MASS, "material": "resin"} for position in positions]
    rail = [[0, 0], [WIDTH, 0], [WIDTH, LENGTH], [0, LENGTH]]
    return from_document(
        {
            "world": {"duration": 10.0},
            "solver": {"dt": FRAME, "substeps": round(FRAME * rate)},
            "surface": {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.0127},
            "contact_models": {"ball_ball": "frictional", "cushion": "han2005"},
            "material": [{"name": "resin"}],
            "pair": [{"between": ["resin", "resin"], "restitution": 0.95}],
            "wall": [{"points": rail, "closed": True, "height": 1.28 * RADIUS, "restitution": 0.85, "friction": 0.2}],
            "ball": [{**balls[0], "velocity": [0.0, SPEED]}, *balls[1:]],
        }
    )


def path(scene: Scene, engine: str = "pymunk") -> FloatArray:
    """Return the positions of all balls in each frame, (T, N, 2) m."""
    simulation, positions = start(scene, engine), []
    for _ in range(round((FIRST_HIT + LAST) / FRAME)):
        simulation.step()
        positions.append(simulation.frame().position)
    simulation.close()
    return np.asarray(positions)


def divergence_time(first: FloatArray, second: FloatArray) -> float:
    """Return the time at which two paths first differ too much, s; inf if they never do."""
    far = (np.hypot(*np.moveaxis(first - second, 2, 0)) > MAX_DISTANCE).any(axis=1)
    return FRAME * (int(far.argmax()) + 1) - FIRST_HIT if far.any() else math.inf


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
                other = rack(seed, gap, rate if arguments.against else rate * REFINEMENT)
                times.append(divergence_time(path(rack(seed, gap, rate)), path(other, arguments.against or "pymunk")))
            least, median = min(times), statistics.median(times)
            print(f"gap {gap:5g} m, {rate:3} Hz: {least:.2f} s at least, {median:.2f} s in the median", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
