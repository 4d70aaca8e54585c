"""Step schedule of a run: the number and the length of its steps, where actions may change dt."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from sandbox.action import Action, dt_changes
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

ROUNDING = 1e-9
"""Shares of a step by which a time may miss a whole number of steps and count as it."""


class Stretch(NamedTuple):
    """Steps of one length."""

    steps: int
    dt: float
    """s"""
    part: float = 0.0
    """0 ≤ part < 1 of a further step, at the end of a run"""


def schedule(duration: float, dt: float, actions: Sequence[Action] = ()) -> list[Stretch]:
    """Return the stretches of a run; only the last may end with a part of a step.

    Args:
        duration: of the run, s.
        dt: at its start, s.
        actions: in order of time.
    """
    return list(_stretches(duration, dt, actions))


def _stretches(duration: float, dt: float, actions: Sequence[Action]) -> Iterator[Stretch]:
    begin = 0.0
    for time, changed in dt_changes(actions):
        steps = math.ceil((time - begin) / dt - ROUNDING)
        if begin + steps * dt >= duration * (1.0 - ROUNDING):
            break
        if steps > 0:
            yield Stretch(steps, dt)
            begin += steps * dt
        dt = changed
    steps_left = (duration - begin) / dt
    whole = round(steps_left)
    # After a change to a far shorter dt, the digits of the duration itself are what counts.
    digits = min(4.0 * math.ulp(duration) / dt, 0.25) if begin > 0.0 else 0.0
    if abs(steps_left - whole) <= max(ROUNDING * whole, digits):
        yield Stretch(whole, dt)
    else:
        yield Stretch(math.floor(steps_left), dt, steps_left - math.floor(steps_left))


def frame_count(scene: Scene, settings: Settings, actions: Sequence[Action] = ()) -> tuple[int, float]:
    """Return how many whole steps a run has, and the part of a step (0 ≤ part < 1) that is left for its end.

    A duration within rounding of a whole number of steps is that number.
    """
    stretches = schedule(scene.world.duration, settings.dt, actions)
    return sum(stretch.steps for stretch in stretches), stretches[-1].part


def with_whole_steps(scene: Scene, dt: float) -> Scene:
    """Return a scene whose duration is a whole number of steps of dt, s: the next one, if its own is none.

    Some engines make whole steps only (`Simulation.makes_whole_steps`). With such a duration all runs end at the same
    time and can be compared to the end.
    """
    (stretch,) = schedule(scene.world.duration, dt)
    return scene.with_duration((stretch.steps + 1) * dt) if stretch.part else scene
