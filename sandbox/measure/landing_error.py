"""Landing error of a shot on level ground, by engine, integrator and time step.

The reference is the closed form or, with quadratic drag, the trajectory of `sandbox.games.artillery.ballistics`. The
simulated impact is found on the cubic Hermite curve through the last two frames.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.registry import ENGINES, start
from sandbox.games.artillery.ballistics import MAX_FLIGHT, NO_DISCS, ShellImpact, landing
from sandbox.games.artillery.shells import SHELL_MASS, SHELL_RADIUS, FlightSegment
from sandbox.games.artillery.terrain import Ground
from sandbox.jsonable import in_json
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings, World
from sandbox.signals import reraise_interrupt
from sandbox.trajectory import Frame

STEPS = 1 / 15, 1 / 60, 1 / 240
"""s, time steps of the table"""
MAX_TIME_FACTOR = 2.0
"""limit of the simulated time of flight, as a multiple of `MAX_FLIGHT`"""
MAX_RANGE = 1e6
"""m, limit of the range"""


@dataclass(frozen=True)
class LandingError:
    """A row of the table."""

    engine: str
    integrator: str | None
    """None for an engine without a choice of integrators"""
    dt: float
    """s, time step"""
    range: float = field(metadata=in_json(key="place"))
    """m, simulated range"""
    time: float
    """s, time of flight"""
    range_error: float = field(metadata=in_json(key="off"))
    """m, error of the range; negative if the shot falls short"""
    time_error: float = field(metadata=in_json(key="late"))
    """s, error of the time of flight"""


class RefusedFlight(NamedTuple):
    """Engine that does not support the shot."""

    engine: str
    reason: str


class LandingErrorTable(NamedTuple):
    """Exact range of a shot, and the errors of the engines."""

    range: float
    """m, exact"""
    time: float
    """s, exact time of flight"""
    rows: tuple[LandingError, ...]
    refused: tuple[RefusedFlight, ...]
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
    keys = ("gravity", "linear_drag", "quadratic_drag", "damping", "wind")
    world = World(**{key: getattr(world, key) for key in keys})
    exact = exact_landing(world, velocity)
    rows: list[LandingError] = []
    refused: dict[tuple[str, str | None], str] = {}
    interrupted = False
    for (engine, integrator), dt in product(_engine_integrators(), dict.fromkeys(dts)):
        if (engine, integrator) in refused:
            continue
        if on_progress is not None:
            on_progress(Progress(f"{engine}{f', {integrator}' if integrator else ''}, dt {dt:g} s"))
        settings = Settings().replace(dt=dt, integrator=integrator)
        try:
            impact = simulated_landing(world, velocity, engine, settings)
        except Refusal as refusal:
            refused[engine, integrator] = "; ".join(refusal.reasons)
            continue
        except Divergence as error:
            refused[engine, integrator] = str(error)
            continue
        except KeyboardInterrupt:
            interrupted = True
            break
        x, time = impact.position[0], impact.time
        rows.append(LandingError(engine, integrator, dt, x, time, x - exact.position[0], time - exact.time))
    refusals = dict.fromkeys(RefusedFlight(engine, reason) for (engine, _), reason in refused.items())
    return LandingErrorTable(exact.position[0], exact.time, tuple(rows), tuple(refusals), interrupted)


def _engine_integrators() -> Iterator[tuple[str, str | None]]:
    for engine in ENGINES:
        for integrator in INTEGRATORS if engine == "reference" else (None,):
            yield engine, integrator


def exact_landing(world: World, velocity: FloatArray) -> ShellImpact:
    """Return the exact impact of a shot on level ground, relative to its start.

    Raises:
        ValueError: the shot does not land within the limits of time and range.
    """
    approximate = _landing_on_level_ground(MAX_RANGE, world, velocity)
    return _landing_on_level_ground(
        1.0 + 2.0 * abs(approximate.position[0]), world, velocity
    )  # a smaller offset has smaller rounding errors


def _landing_on_level_ground(half_width: float, world: World, velocity: FloatArray) -> ShellImpact:
    """Return the impact relative to the start, on ground that extends by `half_width`, m, to either side of it.

    Raises:
        ValueError: the shot does not land within the limits of time and range.
    """
    impact = landing(world, np.array([half_width, 0.0]), velocity, Ground(np.zeros(2), 2.0 * half_width))
    if impact is None:
        raise ValueError(f"the shot does not come down within {MAX_FLIGHT:g} s and {MAX_RANGE:g} m")
    return impact._replace(position=(impact.position[0] - half_width, impact.position[1]))


@reraise_interrupt()
def simulated_landing(world: World, velocity: FloatArray, engine: str, settings: Settings) -> ShellImpact:
    """Return the impact of a shot on level ground as an engine simulates it, on the cubic through the last two frames.

    Raises:
        Refusal: the engine does not support the shot.
        Divergence: the shot leaves the bounds of the engine.
        ValueError: the shot does not land within the limit of time.
    """
    vx, vy = velocity.tolist()
    ball = Ball(position=(0.0, 0.0), velocity=(vx, vy), radius=SHELL_RADIUS, mass=SHELL_MASS, collides="none")
    scene = Scene(world=world, solver=settings, balls=(ball,))
    simulation = start(scene, engine, settings)
    before, now = simulation.frame(), simulation.frame()
    for _ in range(math.ceil(MAX_TIME_FACTOR * MAX_FLIGHT / settings.dt)):
        before = now
        simulation.step()
        now = simulation.frame()
        if now.position[0, 1] <= 0.0:
            break
    else:
        raise ValueError(f"on {engine} the shot does not come down within {MAX_TIME_FACTOR * MAX_FLIGHT:g} s")
    simulation.close()
    half_width = 1.0 + 2.0 * abs(float(now.position[0, 0]))
    step = FlightSegment(_state(before, half_width), _state(now, half_width), now.time - before.time)
    found = step.meets(Ground(np.zeros(2), 2.0 * half_width), NO_DISCS, 1.0)
    fraction = 1.0 if found is None else found[0]
    return ShellImpact(
        before.time + fraction * (now.time - before.time), (float(step.at(fraction)[0]) - half_width, 0.0)
    )


def _state(frame: Frame, offset: float) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity of the only body, shifted to the right by `offset`, m."""
    return frame.position[0] + np.array([offset, 0.0]), frame.velocity[0]
