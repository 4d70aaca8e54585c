"""Miss: how far from where it should a shot comes down on level ground, by engine, integrator and step."""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.registry import ENGINES, start
from sandbox.games.artillery.ballistics import MAX_FLIGHT, NO_DISCS, Landing, landing
from sandbox.games.artillery.shells import SHELL_MASS, SHELL_RADIUS, FlightSegment
from sandbox.games.artillery.terrain import Ground
from sandbox.interrupt import heeded
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings, World
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

STEPS = 1 / 15, 1 / 60, 1 / 240
"""s, of the table"""
LATER = 2.0
"""times as long as the longest true flight, that an engine's is followed"""
FAR = 1e6
"""m, beyond which no shot is looked for"""


class LandingError(NamedTuple):
    """A row of the table."""

    engine: str
    integrator: str | None
    """none where an engine has but one way to fly"""
    dt: float
    """s"""
    place: float
    """m, how far off it comes down"""
    time: float
    """s, after which"""
    off: float
    """m, by how much that is too far; negative where it falls short"""
    late: float
    """s, by how much it is in the air for too long"""


class LandingErrorTable(NamedTuple):
    """Where a shot should come down, and where it does."""

    range: float
    """m"""
    time: float
    """s"""
    rows: tuple[LandingError, ...]
    refused: tuple[tuple[str, str], ...]
    """engines that do not fly it, and why"""
    interrupted: bool = False
    """Ctrl-C was pressed before every row was found."""


def landing_error_table(
    world: World, speed: float, angle: float, dts: Sequence[float] = STEPS, told: Callable[[str], None] | None = None
) -> LandingErrorTable:
    """Fly a shot over level ground on every engine, with every integrator and step, and return by how much each misses.

    The truth is the closed form, or with quadratic drag Runge–Kutta's flight at steps of 1/128 s.

    Args:
        world: gives gravity, drag and wind.
        speed: m/s.
        angle: rad, anticlockwise from the right.
        dts: steps, s.
        told: called with what is flown.

    Raises:
        ValueError: the shot does not come down, or so late or far away that it is not followed.
    """
    velocity = speed * np.array([math.cos(angle), math.sin(angle)])
    world = World(**{key: getattr(world, key) for key in ("gravity", "linear_drag", "quadratic_drag", "wind")})
    true = _exact(world, velocity)
    rows: list[LandingError] = []
    refused: dict[tuple[str, str | None], str] = {}
    interrupted = False
    for (engine, integrator), dt in product(_ways(), dict.fromkeys(dts)):
        if (engine, integrator) in refused:
            continue
        if told is not None:
            told(f"{engine}{f', {integrator}' if integrator else ''}, dt {dt:g} s")
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


def _exact(world: World, velocity: FloatArray) -> Landing:
    """Return where a shot comes down that starts on level ground, from there on.

    Raises:
        ValueError: it never does, or too late, or too far away.
    """
    near = _from(FAR, world, velocity)
    return _from(1.0 + 2.0 * abs(near.place[0]), world, velocity)  # nearer to 0, where there is less to round


def _from(half: float, world: World, velocity: FloatArray) -> Landing:
    """Return the same, found on ground that goes so far to either side, m."""
    down = landing(world, np.array([half, 0.0]), velocity, Ground(np.zeros(2), 2.0 * half))
    if down is None:
        raise ValueError(f"the shot does not come down within {MAX_FLIGHT:g} s and {FAR:g} m")
    return down._replace(place=(down.place[0] - half, down.place[1]))


@heeded()
def simulated_landing(world: World, velocity: FloatArray, engine: str, settings: Settings) -> Landing:
    """Return where an engine lets a shot come down on level ground, from the cubic through its last two frames.

    Raises:
        Refusal: it does not fly it.
        ValueError: the shot does not come down.
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
    share = 1.0 if found is None else found[0]
    return Landing(before.time + share * (now.time - before.time), (float(step.at(share)[0]) - half, 0.0))


def _state(frame: Frame, aside: float) -> tuple[FloatArray, FloatArray]:
    """Return place and velocity of the one body, moved aside, m."""
    return frame.position[0] + np.array([aside, 0.0]), frame.velocity[0]
