"""Settings of the physics with which a game runs again: its calls of `Space.step` are cut into substeps."""

import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, fields
from time import thread_time
from typing import Any, Self
from unittest.mock import patch
from weakref import WeakSet

import numpy as np
import pymunk

from sandbox.echo import short_repr, shorten

MAX_SUBSTEPS = 4096
WINDOW = 5
"""Steps of which the median time counts"""


@dataclass(frozen=True)
class RehearsalSettings:
    """Settings that replace those of the game; None keeps its own."""

    substeps: int = 1
    """steps into which each step of the game is cut"""
    dt: float | None = None
    """s, longest substep: a longer one is cut into more, of equal length"""
    iterations: int | None = None
    """`Space.iterations`"""
    slop: float | None = None
    """`Space.collision_slop`, in units of the game"""
    bias: float | None = None
    """`Space.collision_bias`"""
    persistence: int | None = None
    """`Space.collision_persistence`"""
    joint_bias: float | None = None
    """`Constraint.error_bias` of every joint"""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: a value is out of its range.
        """
        for name, value in asdict(self).items():
            low, high = RANGES[name]
            if value is not None and not low <= value <= high:
                raise ValueError(f"{name}: must be {low:g} to {high:g}, not {value:g}")

    @classmethod
    def of(cls, values: Mapping[str, str]) -> Self:
        """Return settings from texts, by their names.

        Raises:
            ValueError: a name is unknown, or a value is no number or out of its range.
        """
        kinds = {"substeps": int, "iterations": int, "persistence": int}
        found: dict[str, Any] = {}
        for name, text in values.items():
            if name not in RANGES:
                raise ValueError(f"{shorten(name)}: is no setting of a game; settings are {', '.join(RANGES)}")
            try:
                found[name] = kinds.get(name, float)(text)
            except ValueError:
                kind = "a whole number" if name in kinds else "a number"
                raise ValueError(f"{name}: {short_repr(text)} is not {kind}") from None
        return cls(**found)

    @property
    def changed(self) -> dict[str, float]:
        """The settings that differ from those of the game, by name."""
        return {
            each.name: value for each in fields(self) if (value := getattr(self, each.name)) not in (None, each.default)
        }

    def __str__(self) -> str:
        """Return the changed settings; `as in the game` if there are none."""
        return ", ".join(f"{name} = {value:g}" for name, value in self.changed.items()) or "as in the game"

    def count(self, dt: float) -> int:
        """Return the number of substeps of a step of the game.

        Args:
            dt: its length, s.
        """
        finer = 1 if self.dt is None else math.ceil(abs(dt) / self.substeps / self.dt * (1.0 - 1e-12))
        return self.substeps * max(finer, 1)


RANGES: Mapping[str, tuple[float, float]] = {
    "substeps": (1, MAX_SUBSTEPS),
    "dt": (1e-6, 1e6),
    "iterations": (1, 10_000),
    "slop": (0.0, 1e6),
    "bias": (0.0, 1.0),
    "persistence": (0, 1000),
    "joint_bias": (0.0, 1.0),
}
"""Least and largest value of each setting"""
SPACE_ATTRIBUTES: dict[str, str] = {
    "iterations": "iterations",
    "slop": "collision_slop",
    "bias": "collision_bias",
    "persistence": "collision_persistence",
}
"""Attribute of a space for each setting that is one"""


@dataclass(frozen=True)
class Nudge:
    """Small displacement of all moving bodies before the first step of a space."""

    distance: float
    """largest displacement in x and y, in units of the game"""
    seed: int
    """of the random numbers"""


@dataclass
class StepClock:
    """Processor times of the steps of all spaces, of the thread that makes them.

    The time of the whole process advances in coarse ticks on some systems once the processor time is limited.
    """

    times: list[float] = field(default_factory=list)
    """time of each step, with the callbacks of the game that it calls, s"""
    has_forces: bool = False
    """whether the game applies forces for a step, in a run with substeps"""

    @property
    def seconds(self) -> float:
        """Time of all steps, s; that of each is the median of five, because interrupts make single ones longer."""
        if len(self.times) < WINDOW:
            return sum(self.times)
        times = np.pad(np.asarray(self.times), WINDOW // 2, mode="edge")
        return float(np.median(np.lib.stride_tricks.sliding_window_view(times, WINDOW), axis=1).sum())


@contextmanager
def steps_with(
    settings: RehearsalSettings,
    *,
    nudge: Nudge | None = None,
) -> Iterator[StepClock]:
    """Let all pymunk spaces make their steps with other settings, within a `with` block.

    pymunk resets the forces on a body after each step. A force that the game applies for a step acts in all its
    substeps.

    Args:
        settings: of the steps.
        nudge: of the bodies before the first step.

    Yields:
        The time that the steps take.
    """
    step, clock = pymunk.Space.step, StepClock()
    overrides = [
        (attribute, getattr(settings, name))
        for name, attribute in SPACE_ATTRIBUTES.items()
        if getattr(settings, name) is not None
    ]
    nudged: WeakSet[pymunk.Space] = WeakSet()

    def stepped(space: pymunk.Space, dt: float) -> None:
        for attribute, value in overrides:
            setattr(space, attribute, value)
        if settings.joint_bias is not None:
            for joint in space.constraints:
                joint.error_bias = settings.joint_bias
        if nudge is not None and space not in nudged:
            nudged.add(space)
            _move(space, nudge)
        count = settings.count(dt)
        forces = [] if count == 1 else _forces(space)
        clock.has_forces |= bool(forces)
        for substep in range(count):
            if substep:
                for body, force, torque in forces:
                    body.force, body.torque = force, torque
            start = thread_time()
            step(space, dt if count == 1 else dt / count)
            clock.times.append(thread_time() - start)

    with ExitStack() as stack:
        stack.enter_context(patch.object(pymunk.Space, "step", stepped))
        yield clock


def _forces(space: pymunk.Space) -> list[tuple[pymunk.Body, pymunk.Vec2d, float]]:
    """Return the bodies that a force or a torque acts on, with both."""
    return [
        (body, body.force, body.torque)
        for body in space.bodies
        if body.body_type == pymunk.Body.DYNAMIC and (any(body.force) or body.torque)
    ]


def _move(space: pymunk.Space, nudge: Nudge) -> None:
    """Displace all moving bodies, each by random amounts."""
    random = np.random.Generator(np.random.PCG64(nudge.seed))
    for body in space.bodies:
        if body.body_type == pymunk.Body.DYNAMIC:
            x, y = random.uniform(-nudge.distance, nudge.distance, 2)
            body.position = body.position.x + float(x), body.position.y + float(y)
