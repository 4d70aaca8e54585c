"""Actions that change a session and not only its engine: launches, explosions, joints that come and go; events.

Each function computes what an action changes; `SwitchableSimulation` applies it.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import count, takewhile
from typing import Any

import numpy as np

from sandbox.action import (
    Action,
    ActionError,
    Actuate,
    Explosion,
    Force,
    Impulse,
    Join,
    Launch,
    Steer,
    Throttle,
    Unjoin,
    check_speed,
    in_order,
)
from sandbox.arrays import BoolArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.generators import GeneratorError, count_of, layout_of
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.compile.joints import compile_added_joint
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource
from sandbox.scene.description.fixed import AWAY
from sandbox.scene.validate.references import check_joints, generators, listed_names
from sandbox.trajectory import Frame


class PersistentActions:
    """Actions that keep acting: forces by the name of the body, levels by that of the thrust, tyre or motor."""

    def __init__(
        self,
        forces: Mapping[str, Force] | None = None,
        throttles: Mapping[str, Throttle] | None = None,
        steering: Mapping[str, Steer] | None = None,
        motor_levels: Mapping[str, float] | None = None,
    ) -> None:
        self._forces, self._throttles = dict(forces or {}), dict(throttles or {})
        self._steering, self._motor_levels = dict(steering or {}), dict(motor_levels or {})

    def record(self, action: Action) -> None:
        """Record an action that was applied."""
        if action.kind == "throttle":
            self._throttles[action.thrust] = action
        elif action.kind == "steer":
            self._steering[action.tyre] = action
        elif action.kind == "actuate":
            self._motor_levels |= action.levels
        elif action.kind == "force":
            self._forces[action.body] = action
        elif action.kind == "remove":
            self._forces.pop(action.body, None)

    def remove_forces(self, removed: Iterable[str]) -> None:
        """Remove the forces on bodies that have left the scene."""
        for name in removed:
            self._forces.pop(name, None)

    def keep_motors(self, joints: Collection[str]) -> None:
        """Remove the levels of motors of other joints, which have broken or were removed."""
        self._motor_levels = {name: level for name, level in self._motor_levels.items() if name in joints}

    @property
    def forces(self) -> dict[str, Force]:
        """Constant force on each body."""
        return dict(self._forces)

    @property
    def throttles(self) -> dict[str, Throttle]:
        """Throttle of each thrust."""
        return dict(self._throttles)

    @property
    def steering(self) -> dict[str, Steer]:
        """Levels of each tyre."""
        return dict(self._steering)

    @property
    def motor_levels(self) -> dict[str, float]:
        """Level of each motor that was set, by the name of its joint."""
        return dict(self._motor_levels)

    def actions(self, joints: JointArrays) -> list[Force | Throttle | Steer | Actuate]:
        """Return the actions that reproduce the forces and levels in another simulation.

        Args:
            joints: those that are left; the other motors have broken or were removed.
        """
        levels = {name: level for name, level in self._motor_levels.items() if name in joints.motor_rows}
        motors = [Actuate(time=0.0, levels=levels)] if levels else []
        return [*self._forces.values(), *self._throttles.values(), *self._steering.values(), *motors]


def launch_state(action: Launch, scene: Scene, bodies: Bodies, frame: Frame) -> tuple[Frame, Bodies, BoolArray]:
    """Return the state after a launch of a generator, all bodies, and which of them were launched, (N,).

    Bodies of the generator that were gone return; lifetimes start again.

    Raises:
        ActionError: there is no such generator, or there is no space for its bodies.
    """
    found = next(((index, source) for name, index, source in generators(scene) if name == action.generator), None)
    if found is None:
        raise ActionError(f"no generator is named {action.generator!r}")
    index, generator = found
    try:
        layout = layout_of(generator, action.seed, index, scene.world.gravity)
    except GeneratorError as error:
        raise ActionError(str(error)) from None
    first = _first_body(scene, generator)
    is_launched = np.zeros(len(bodies), np.bool_)
    is_launched[first : first + len(layout)] = True
    columns = {}
    for key in ("position", "velocity", "angle", "angular_velocity"):
        columns[key] = getattr(frame, key).copy()
        columns[key][is_launched] = getattr(layout, key)
    if layout.lifetime is not None:
        born, lifetime = bodies.born.copy(), bodies.lifetime.copy()
        born[is_launched], lifetime[is_launched] = frame.time, layout.lifetime
        bodies = replace(bodies, born=born, lifetime=lifetime)
    roll = frame.roll
    if roll is not None:  # bodies of a generator start without roll
        roll = np.where(is_launched[:, None], 0.0, roll)
    layer, visits = frame.layer, frame.visits
    if layer is not None:
        layer = np.where(is_launched, scene.layers.index(generator.layer), layer)
    if visits is not None:
        visits = np.where(is_launched[:, None], AWAY, visits)
    launched_frame = Frame(
        frame.time, present=frame.present | is_launched, roll=roll, layer=layer, visits=visits, **columns
    )
    passing = frame.passing
    if passing is not None:
        passing = passing[~is_launched[passing[:, 0]]]
    return replace(launched_frame, drives=frame.drives, passing=passing), bodies, is_launched


def _first_body(scene: Scene, generator: BodySource) -> int:
    """Return the index of a generator's first body."""
    sources = scene.body_sources
    return sum(count_of(each) for each in sources[: next(k for k, each in enumerate(sources) if each is generator)])


def explosion_impulses(action: Explosion, scene: Scene, bodies: Bodies, frame: Frame) -> list[Impulse]:
    """Return the impulses of an explosion on the bodies that it moves.

    Raises:
        ActionError: a body would be too fast.
    """
    away = frame.position - np.asarray(action.position)
    distance = np.hypot(*away.T)
    moves = frame.present & ~bodies.immovable & ~is_driven(scene, bodies)
    hit = np.flatnonzero(moves & (distance < action.radius) & (distance > 0.0))
    impulse = action.impulse * (1.0 / distance[hit] - 1.0 / action.radius)[:, None] * away[hit]
    for index, velocity in zip(hit.tolist(), frame.velocity[hit] + impulse / bodies.mass[hit, None], strict=True):
        check_speed(math.hypot(*velocity), f"the explosion at {bodies.names[index]!r}")
    pairs = zip(hit.tolist(), impulse.tolist(), strict=True)
    return [Impulse(time=action.time, body=bodies.names[index], impulse=(x, y)) for index, (x, y) in pairs]


def added_joint(action: Join, setup: Setup, bodies: Bodies, frame: Frame, broken: Mapping[int, float]) -> JointArrays:
    """Return the rows of a joint that is added to a session.

    Args:
        action: the action.
        setup: with the joints so far.
        bodies: all bodies of the session.
        frame: the present state.
        broken: the joints that have broken.

    Raises:
        ActionError: the joint is invalid, or its name is that of another one.
    """
    state = ("position", "velocity", "angle", "angular_velocity")
    bodies = replace(bodies, **{key: getattr(frame, key) for key in state})
    faults = list(check_joints([action.joint], setup.scene, bodies.some(np.flatnonzero(frame.present))))
    if faults:
        listed = (f"{'.'.join(map(str, location[2:]))}: {message}" for location, message in faults)
        raise ActionError(f"joint: {'; '.join(listed)}")
    taken = intact_joint_names(setup, broken)
    name = action.joint.name or next(each for k in count(1) if (each := f"joined-{k}") not in taken)
    if name in taken:
        raise ActionError(f"a joint is already named {name!r}")
    return compile_added_joint(action.joint, name, bodies, len(setup.joints))


def removed_joint(action: Unjoin, setup: Setup, broken: Mapping[int, float]) -> list[int]:
    """Return the rows of a joint that is removed.

    Raises:
        ActionError: there is no such joint.
    """
    found = [k for k, name in enumerate(setup.joints.names) if name == action.joint and k not in broken]
    if not found:
        raise ActionError(f"no joint is named {action.joint!r}; {listed_names(intact_joint_names(setup, broken))}")
    return [int(row) for row in setup.joints.whole(np.asarray(found))]


def intact_joint_names(setup: Setup, broken: Mapping[int, float]) -> set[str]:
    """Return the names of the joints that are there."""
    first = setup.joints.part_of == setup.joints.number
    return {setup.joints.names[k] for k in np.flatnonzero(first).tolist() if k not in broken}


class EventQueue:
    """Events of a scene that have not happened yet, in the order of their times."""

    def __init__(self, events: Iterable[Action]) -> None:
        self.pending = in_order(tuple(events))
        """the events"""

    def __deepcopy__(self, _: dict[int, Any]) -> "EventQueue":
        """Return a copy that shares the events, which never change."""
        return EventQueue(self.pending)

    @property
    def next(self) -> float:
        """Time of the next event, s; inf without any."""
        return self.pending[0].time if self.pending else math.inf

    def due(self, time: float) -> tuple[Action, ...]:
        """Return the events up to a time, s, and remove them."""
        due = tuple(takewhile(lambda event: event.time <= time, self.pending))
        self.pending = self.pending[len(due) :]
        return due


def events_from(setup: Setup) -> Iterator[Action]:
    """Yield the events of a scene that follow the beginning of a setup, at times since then."""
    return (event.at(event.time - setup.time) for event in setup.scene.events if event.time >= setup.time)


def remaining_event(
    event: Action, setup: Setup, bodies: Bodies, frame: Frame, broken: Mapping[int, float]
) -> Action | None:
    """Return an event without the motors that have left; None if its body, its joint or all its motors have left."""
    if isinstance(event, Unjoin):
        has_left = event.joint in setup.joints.names and event.joint not in intact_joint_names(setup, broken)
        return None if has_left else event
    if isinstance(event, Actuate):
        joints, is_present = setup.joints, np.append(frame.present, True)  # index −1, the world, is the last entry
        both = (is_present[joints.a] & is_present[joints.b]).tolist()
        remaining = {name for k, name in enumerate(joints.names) if both[k] and k not in broken}
        left = set(joints.names) - remaining
        levels = {name: level for name, level in event.levels.items() if name not in left}
        return event.model_copy(update={"levels": levels}) if levels else None
    named = event.joint.between if isinstance(event, Join) else (getattr(event, "body", None),)
    has_left = any(name in bodies.names and not frame.present[bodies.names.index(name)] for name in named)
    return None if has_left else event
