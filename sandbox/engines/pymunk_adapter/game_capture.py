"""Recordings of games that use pymunk: `Space.step` is watched while the game runs.

The scene of a space is that before its first step. What the code of the game changes between two steps becomes
actions before the next step: velocities and positions, forces, gravity, damping, bodies added and removed. So the
recording can be replayed, on this engine to the same bits, and on other engines and settings to compare.

What actions cannot state is a remark and never left out silently, as in `capture`.
"""

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Set
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import pymunk

from sandbox.action import Action, Force, Move, Remove, SetParameter, Spawn
from sandbox.engines.pymunk_adapter.capture import (
    NOT_TURNED,
    CapturedSpace,
    SpaceElements,
    coefficients_of,
    scene_of,
)
from sandbox.engines.pymunk_adapter.joint_capture import joint_values, motor_values
from sandbox.recording import Recording
from sandbox.scene.errors import quoted

MAX_ACTIONS = 1_000_000
"""Actions of a recording; a game that changes 1,000 bodies at 60 Hz makes as many in 17 s"""


class MotionState(NamedTuple):
    """Motion of a body."""

    position: tuple[float, float]
    """m"""
    velocity: tuple[float, float]
    """m/s"""
    angle: float
    """rad"""
    angular_velocity: float
    """rad/s"""

    @classmethod
    def of(cls, body: pymunk.Body) -> "MotionState":
        """Return the present motion of a body."""
        (x, y), (vx, vy) = body.position, body.velocity
        return cls((x, y), (vx, vy), body.angle, body.angular_velocity)


@dataclass(frozen=True)
class SpaceForm:
    """What a game may change in a space that no action of a recording states."""

    settings: tuple[float, ...]
    bodies: Mapping[pymunk.Body, tuple[Any, ...]]
    """type, mass, moment and functions of the bodies that are in the space"""
    shapes: Mapping[pymunk.Shape, tuple[Any, ...]]
    """body, filter and kind of each shape"""
    coefficients: Mapping[pymunk.Shape, dict[str, Any]]
    """as `coefficients_of` each shape"""
    joints: Mapping[pymunk.Constraint, tuple[Any, ...]]
    """values of each joint, without those of motors, and whether its bodies collide"""
    motors: Mapping[pymunk.SimpleMotor, dict[str, Any]]
    """values of motors, as keys of their tables"""

    @classmethod
    def of(cls, space: pymunk.Space, bodies: Collection[pymunk.Body]) -> "SpaceForm":
        """Return the form of a space; of its bodies only some."""
        return cls(
            (
                space.iterations,
                space.collision_slop,
                space.collision_bias,
                space.collision_persistence,
                space.sleep_time_threshold,
                space.idle_speed_threshold,
                len(getattr(space, "_handlers", ())),
            ),
            {
                body: (body.body_type, body.mass, body.moment, body._velocity_func, body._position_func)
                for body in bodies
                if body.space is space
            },
            {each: (each.body, each.filter, each.sensor) for each in space.shapes},
            {each: coefficients_of(each) for each in space.shapes},
            {
                joint: (
                    None if isinstance(joint, pymunk.SimpleMotor) else joint_values(joint, space.collision_bias),
                    joint.collide_bodies,
                )
                for joint in space.constraints
            },
            {joint: motor_values(joint) for joint in space.constraints if isinstance(joint, pymunk.SimpleMotor)},
        )

    def changes_since(self, before: "SpaceForm", explained: Set[pymunk.Body]) -> Iterator[str]:
        """Yield what has changed since an earlier form.

        Args:
            before: the earlier form.
            explained: bodies that were added or removed by actions, with their shapes.
        """
        if self.settings != before.settings:
            yield "settings and callbacks of the space that the game changes"
        if any(self.bodies[body] != before.bodies[body] for body in self.bodies.keys() & before.bodies.keys()):
            yield "types, masses, moments and functions of bodies that the game changes"
        exchanged = {*self.shapes.items()} ^ {*before.shapes.items()}
        if any(shape in self.shapes and shape in before.shapes for shape, _ in exchanged):
            yield "filters of shapes that the game changes"
        single = [values for shape, values in exchanged if (shape in self.shapes) != (shape in before.shapes)]
        if any(values[0] not in explained for values in single):
            yield "shapes that the game adds to bodies or removes from them"
        if self.joints.keys() != before.joints.keys():
            yield "joints that the game adds or removes"
        if any(self.joints[joint] != before.joints[joint] for joint in self.joints.keys() & before.joints.keys()):
            yield "joints that the game changes, other than the rate and the largest torque of motors"


class SpaceCapture:
    """Recording of one space, step by step.

    Args:
        space: before its first step.
        dt: argument of the first step, s.
    """

    def __init__(self, space: pymunk.Space, dt: float) -> None:
        self.space, self.dt, self.steps = space, dt, 0
        elements = SpaceElements(space, {}, notes_forces=False)
        captured = scene_of(elements, dt, 10.0, "")
        self._paths, self._joint_paths = elements.paths, elements.joint_paths
        self._wall_bodies = {
            shape.body for shape, path in elements.paths.items() if path.startswith(("wall[", "post["))
        }
        self._scene, self._names, self._is_kinematic = captured.scene, elements.names, elements.is_kinematic
        self._omitted, self._inexact = dict.fromkeys(captured.omitted), dict.fromkeys(captured.inexact)
        self._actions: list[Action] = []
        self._states = {body: MotionState.of(body) for body in self._names}
        self._forces: dict[pymunk.Body, tuple[float, float, float]] = {}
        self._gravity, self._damping = tuple(space.gravity), space.damping
        self._scene_bodies = set(captured.scene.bodies.names)
        self._unused: set[pymunk.Body] = set()  # bodies that nothing touches: they have sensors only
        self._form = SpaceForm.of(space, self._names)

    def before_step(self, dt: float) -> None:
        """Note what the game has changed since the last step."""
        space = self.space
        if dt != self.dt:
            self._omitted["the step, which the game varies; a scene has a constant dt"] = None
        if len(self._actions) > MAX_ACTIONS:
            self._omitted[f"actions after the first {MAX_ACTIONS:,}"] = None
            return
        if tuple(space.gravity) != self._gravity:
            self._gravity = tuple(space.gravity)
            self._actions.append(SetParameter(time=self.time, path="world.gravity", value=list(self._gravity)))
        if space.damping != self._damping:
            self._damping = space.damping
            if 0.0 < space.damping <= 1.0:
                self._actions.append(SetParameter(time=self.time, path="world.damping", value=space.damping))
            else:
                self._omitted[
                    f"space.damping = {space.damping:g}, which the game sets; `world.damping` is above 0 and at most 1"
                ] = None
        if self.steps:
            form, known = SpaceForm.of(space, self._names), set(self._names)
            self._note_population()
            self._omitted |= dict.fromkeys(form.changes_since(self._form, known ^ set(self._names)))
            self._note_coefficients(form)
            self._note_motors(form)
            self._note_motion()
        self._note_forces()

    def after_step(self) -> None:
        """Note the state after a step."""
        self.steps += 1
        self._states = {body: MotionState.of(body) for body in self._names}
        self._form = SpaceForm.of(self.space, self._names)

    def omit(self, remark: str) -> None:
        """Note something that the recording lacks."""
        self._omitted[remark] = None

    @property
    def time(self) -> float:
        """Time of the next step, s."""
        return self.steps * self.dt

    def _note_population(self) -> None:
        """Note bodies that were added or removed. Bodies without shapes and joints are not used."""
        present = [body for body in self.space.bodies if body.shapes or body in self._names]
        for body in self._form.bodies.keys() - {*self.space.bodies, self.space.static_body}:
            name = self._names.pop(body)
            self._paths = {shape: path for shape, path in self._paths.items() if shape.body is not body}
            if name in self._scene_bodies:
                self._actions.append(Remove(time=self.time, body=name))
            else:
                self._omitted["walls and posts that the game removes"] = None
        added = [body for body in present if body not in self._names and body not in self._unused]
        if not added:
            return
        given = self._names | {body: f"added-{self.steps}-{k}" for k, body in enumerate(added, 1)}
        elements = SpaceElements(self.space, given, notes_forces=False)
        self._unused |= set(added) - elements.names.keys()
        for body in (body for body in added if body in elements.names):
            table, values = elements.element_of(body)
            name = str(values["name"])
            if table == "ball" and not values.get("friction") and not values.get("fixed_rotation"):
                self._inexact[NOT_TURNED] = None
            if table == "ball":  # the parts of an added body have no paths
                self._paths |= dict.fromkeys(body.shapes, f"ball.{quoted(name)}")
            spawned: dict[str, Any] = {table: values}
            self._actions.append(Spawn.model_validate_json(json.dumps({"time": self.time, "kind": "spawn"} | spawned)))
            self._names[body], self._states[body] = name, MotionState.of(body)
            self._scene_bodies.add(name)
        self._omitted |= dict.fromkeys(elements.omitted)
        self._inexact |= dict.fromkeys(elements.inexact)

    def _note_coefficients(self, form: SpaceForm) -> None:
        """Note coefficients of shapes that have changed since the last step."""
        for shape, now in form.coefficients.items():
            before = self._form.coefficients.get(shape, now)
            if now == before:
                continue
            if shape.elasticity > 1.0:
                self._omitted["elasticities above 1 that the game sets"] = None
            if shape not in self._paths:
                self._omitted["coefficients of shapes of bodies that the game adds and then changes"] = None
            else:
                self._set_changed(self._paths[shape], before, now)

    def _note_motors(self, form: SpaceForm) -> None:
        """Note rates and largest torques of motors that have changed since the last step."""
        for motor, now in form.motors.items():
            if motor in self._joint_paths:  # others were added later
                self._set_changed(self._joint_paths[motor], self._form.motors.get(motor, now), now)

    def _set_changed(self, path: str, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
        """Set the values of a table, given by its path, that differ from earlier ones."""
        self._actions += [
            SetParameter(time=self.time, path=f"{path}.{key}", value=value)
            for key, value in now.items()
            if value != before[key]
        ]

    def _note_motion(self) -> None:
        """Note bodies whose motion is not that after the last step."""
        for body, name in self._names.items():
            before, now = self._states[body], MotionState.of(body)
            if before == now:
                continue
            if name not in self._scene_bodies or body in self._wall_bodies:
                self._omitted["walls and posts that the game moves"] = None
                continue
            is_moving = body.body_type == pymunk.Body.DYNAMIC or self._is_kinematic(body)
            if not is_moving and now.velocity != before.velocity:
                self._omitted[f"the velocity of {name}, which is not in the space"] = None
            x, y = body.local_to_world(body.center_of_gravity) if any(body.center_of_gravity) else now.position
            angle = now.angle if now.angle != before.angle else None
            velocity = now.velocity if is_moving and now.velocity != before.velocity else None
            is_turned = is_moving and now.angular_velocity != before.angular_velocity
            spin = now.angular_velocity if is_turned else None
            self._actions.append(
                Move(time=self.time, body=name, position=(x, y), angle=angle, velocity=velocity, angular_velocity=spin)
            )

    def _note_forces(self) -> None:
        """Note forces that the game applies for the next step, where they differ from those of the last one."""
        for body, name in self._names.items():
            if body.body_type != pymunk.Body.DYNAMIC:
                continue
            force = (*body.force, body.torque)
            if force != self._forces.get(body, (0.0, 0.0, 0.0)):
                self._forces[body] = force
                action = Force(time=self.time, body=name, force=(force[0], force[1]), torque=force[2])
                self._actions.append(action)

    def recording(self) -> Recording:
        """Return the recording so far.

        Its settings are those that the scene states: others, such as pymunk's persistence, are left to the engine, so
        that other engines can replay it too.
        """
        duration = max(self.time, self.dt)
        return Recording(self._scene, "pymunk", self._scene.solver, tuple(self._actions), duration)

    @property
    def names(self) -> dict[pymunk.Body, str]:
        """Names of the bodies in the scene and the actions."""
        return dict(self._names)

    @property
    def captured(self) -> CapturedSpace:
        """The scene before the first step, and what scene and actions lack."""
        return CapturedSpace(self._scene, tuple(self._omitted), tuple(self._inexact))


class GameCapture:
    """All spaces that a game steps."""

    def __init__(self) -> None:
        self._captures: dict[pymunk.Space, SpaceCapture] = {}

    def step(self, space: pymunk.Space, dt: float) -> SpaceCapture:
        """Note the changes before a step of a space."""
        if space not in self._captures:
            self._captures[space] = SpaceCapture(space, dt)
        found = self._captures[space]
        found.before_step(dt)
        return found

    def note_sleep(self, body: pymunk.Body) -> None:
        """Note a call by which the game wakes a body or puts it to sleep."""
        if body.space in self._captures:
            self._captures[body.space].omit("bodies that the game wakes or puts to sleep by a call")

    @property
    def spaces(self) -> list[SpaceCapture]:
        """Captures of all spaces, in the order of their first steps."""
        return list(self._captures.values())

    @property
    def steps(self) -> int:
        """Largest number of steps of a space."""
        return max((each.steps for each in self._captures.values()), default=0)

    @property
    def recording(self) -> Recording:
        """Recording of the space that made the most steps.

        Raises:
            ValueError: no space has made a step.
        """
        return self._longest.recording()

    @property
    def omitted(self) -> tuple[str, ...]:
        """What that recording lacks."""
        return self._longest.captured.omitted

    @property
    def inexact(self) -> tuple[str, ...]:
        """Reasons for which a replay may differ from the game by rounding."""
        return self._longest.captured.inexact

    @property
    def _longest(self) -> SpaceCapture:
        if not self._captures:
            raise ValueError("no pymunk space has made a step")
        return max(self._captures.values(), key=lambda each: each.steps)


class StepLimitReached(SystemExit):
    """Ends a game that has made the wanted number of steps."""


@contextmanager
def capture(max_steps: int | None = None) -> Iterator[GameCapture]:
    """Record all pymunk spaces that are stepped within a `with` block.

    Args:
        max_steps: steps of a space after which the next one raises `StepLimitReached`; default: unlimited.

    Yields:
        The recordings, which grow with each step.
    """
    game, step = GameCapture(), pymunk.Space.step

    def watched(space: pymunk.Space, dt: float) -> None:
        if max_steps is not None and game.steps >= max_steps:
            raise StepLimitReached(0)
        found = game.step(space, dt)
        step(space, dt)
        found.after_step()

    with ExitStack() as stack:
        stack.enter_context(_replaced(pymunk.Space, "step", watched))
        for name in ("activate", "sleep", "sleep_with_group"):
            stack.enter_context(_replaced(pymunk.Body, name, _noted(game, getattr(pymunk.Body, name))))
        yield game


def _noted(game: GameCapture, method: Callable[..., None]) -> Callable[..., None]:
    """Return a method of bodies that is noted when the game calls it."""

    def noted(body: pymunk.Body, *arguments: Any, **more: Any) -> None:
        method(body, *arguments, **more)
        game.note_sleep(body)

    return noted


@contextmanager
def _replaced(owner: type, name: str, function: Callable[..., None]) -> Iterator[None]:
    """Replace a method of a class within a `with` block."""
    before = getattr(owner, name)
    setattr(owner, name, function)
    try:
        yield
    finally:
        setattr(owner, name, before)
