"""Landing error of a shot on level ground, by engine, integrator and time step.

The reference is the closed form or, with quadratic drag, the trajectory of `sandbox.games.artillery.ballistics`. The
simulated impact is found on the cubic Hermite curve through the last two frames.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.registry import ENGINES, start
from sandbox.games.artillery.ballistics import MAX_FLIGHT, NO_DISCS, ShellImpact, landing
from sandbox.games.artillery.shells import SHELL_MASS, SHELL_RADIUS, FlightSegment
from sandbox.games.artillery.terrain import Ground
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings, World
from sandbox.signals import reraise_interrupt
from sandbox.trajectory import Frame

STEPS = 1 / 15, 1 / 60, 1 / 240
"""s, time steps of the table"""
LATER = 2.0
"""limit of the simulated time of flight, as a multiple of `MAX_FLIGHT`"""
FAR = 1e6
"""m, limit of the range"""


class LandingError(NamedTuple):
    """A row of the table."""

    engine: str
    integrator: str | None
    """None for an engine without a choice of integrators"""
    dt: float
    """s, time step"""
    place: float
    """m, range"""
    time: float
    """s, time of flight"""
    off: float
    """m, error of the range; negative if the shot falls short"""
    late: float
    """s, error of the time of flight"""


class LandingErrorTable(NamedTuple):
    """Exact range of a shot, and the errors of the engines."""

    range: float
    """m, exact"""
    time: float
    """s, exact time of flight"""
    rows: tuple[LandingError, ...]
    refused: tuple[tuple[str, str], ...]
    """engines that do not support the shot, and the reasons"""
    interrupted: bool = False
    """whether Ctrl-C ended the computation before all rows were complete"""


def landing_error_table(
    world: World, speed: float, angle: float, dts: Sequence[float] = STEPS, on_progress: ProgressCallback | None = None
) -> LandingErrorTable:
    """Simulate a shot over level ground on every engine, with every integrator and time step, and return the errors.

    The reference is the closed form or, with quadratic drag, a Runge–Kutta integration in steps of 1/128 s.

    Args:
        world: gravity, drag and wind.
        speed: m/s.
        angle: rad, anticlockwise from the right.
        dts: time steps, s.
        on_progress: progress callback; its message describes the present simulation.

    Raises:
        ValueError: the shot does not land within the limits of time and range.
    """
    velocity = speed * np.array([math.cos(angle), math.sin(angle)])
    world = World(**{key: getattr(world, key) for key in ("gravity", "linear_drag", "quadratic_drag", "wind")})
    true = exact_landing(world, velocity)
    rows: list[LandingError] = []
    refused: dict[tuple[str, str | None], str] = {}
    interrupted = False
    for (engine, integrator), dt in product(_ways(), dict.fromkeys(dts)):
        if (engine, integrator) in refused:
            continue
        if on_progress is not None:
            on_progress(Progress(f"{engine}{f', {integrator}' if integrator else ''}, dt {dt:g} s"))
        settings = Settings().replace(dt=dt, integrator=integrator)
        try:
            down = simulated_landing(world, velocity, engine, settings)
        except Refusal as refusal:
            refused[engine, integrator] = "; ".join(refusal.reasons)
            continue
        except KeyboardInterrupt:
            interrupted = True
            break
        x, time = down.place[0], down.time
        rows.append(LandingError(engine, integrator, dt, x, time, x - true.place[0], time - true.time))
    reasons = dict.fromkeys((engine, reason) for (engine, _), reason in refused.items())
    return LandingErrorTable(true.place[0], true.time, tuple(rows), tuple(reasons), interrupted)


def _ways() -> Iterator[tuple[str, str | None]]:
    for engine in ENGINES:
        for integrator in INTEGRATORS if engine == "reference" else (None,):
            yield engine, integrator


def exact_landing(world: World, velocity: FloatArray) -> ShellImpact:
    """Return the exact impact of a shot on level ground, relative to its start.

    Raises:
        ValueError: the shot does not land within the limits of time and range.
    """
    near = _from(FAR, world, velocity)
    return _from(1.0 + 2.0 * abs(near.place[0]), world, velocity)  # a smaller offset has smaller rounding errors


def _from(half: float, world: World, velocity: FloatArray) -> ShellImpact:
    """Return the impact relative to the start, on ground that extends by `half`, m, to either side of it.

    Raises:
        ValueError: the shot does not land within the limits of time and range.
    """
    down = landing(world, np.array([half, 0.0]), velocity, Ground(np.zeros(2), 2.0 * half))
    if down is None:
        raise ValueError(f"the shot does not come down within {MAX_FLIGHT:g} s and {FAR:g} m")
    return down._replace(place=(down.place[0] - half, down.place[1]))


@reraise_interrupt()
def simulated_landing(world: World, velocity: FloatArray, engine: str, settings: Settings) -> ShellImpact:
    """Return the impact of a shot on level ground as an engine simulates it, on the cubic through the last two frames.

    Raises:
        Refusal: the engine does not support the shot.
        ValueError: the shot does not land within the limit of time.
    """
    vx, vy = velocity.tolist()
    ball = Ball(position=(0.0, 0.0), velocity=(vx, vy), radius=SHELL_RADIUS, mass=SHELL_MASS, collides="none")
    scene = Scene(world=world, solver=settings, balls=(ball,))
    simulation = start(scene, engine, settings)
    before, now = simulation.frame(), simulation.frame()
    for _ in range(math.ceil(LATER * MAX_FLIGHT / settings.dt)):
        before = now
        simulation.step()
        now = simulation.frame()
        if now.position[0, 1] <= 0.0:
            break
    else:
        raise ValueError(f"on {engine} the shot does not come down within {LATER * MAX_FLIGHT:g} s")
    simulation.close()
    half = 1.0 + 2.0 * abs(float(now.position[0, 0]))
    step = FlightSegment(_state(before, half), _state(now, half), now.time - before.time)
    found = step.meets(Ground(np.zeros(2), 2.0 * half), NO_DISCS, 1.0)
    fraction = 1.0 if found is None else found[0]
    return ShellImpact(before.time + fraction * (now.time - before.time), (float(step.at(fraction)[0]) - half, 0.0))


def _state(frame: Frame, aside: float) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity of the only body, shifted to the right by `aside`, m."""
    return frame.position[0] + np.array([aside, 0.0]), frame.velocity[0]
