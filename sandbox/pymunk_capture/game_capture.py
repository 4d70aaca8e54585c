"""Recordings of games that use pymunk: `Space.step` is watched while the game runs.

The scene of a space is that before its first step. What the code of the game changes between two steps becomes
actions before the next step: velocities and positions, forces, gravity, damping, bodies added and removed. So the
recording can be replayed, on this engine to the same bits, and on other engines and settings to compare.

Callbacks act within a step. pymunk adds and removes their bodies, and calls post-step callbacks, after the physics of
the step, which is as between two steps. The motion of a body that another callback or a function of the body sets is
set by an action after the step.

What actions cannot state is a remark and never left out silently, as in `capture`.
"""

import itertools
import json
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from statistics import median_low
from typing import Any

import pymunk
from pydantic import ValidationError

from sandbox.action import Action, Force, Move, Remove, SetParameter, Spawn
from sandbox.jsonable import finite
from sandbox.pymunk_capture.body_reader import BodyReader, BodyState
from sandbox.pymunk_capture.space_capture import (
    NOT_TURNED,
    CaptureError,
    SpaceElements,
    scene_of,
)
from sandbox.pymunk_capture.space_form import MotionState, SpaceForm
from sandbox.pymunk_capture.state_log import StateLog
from sandbox.recording import RecordedGame, Recording
from sandbox.scene.errors import PartError, SettingsError, quoted

MAX_ACTIONS = 1_000_000
"""Actions of a recording; a game that changes 1,000 bodies at 60 Hz makes as many in 17 s"""
NO_FORCE = (0.0, 0.0, 0.0)
PROVISIONAL_DT = 1.0 / 60.0
"""s, step of the scene until the steps of the game are known"""


class SpaceCapture:
    """Recording of one space, step by step.

    Args:
        space: before its first step.
        form_changes: returns the number of changes of the form of any space so far.
    """

    def __init__(self, space: pymunk.Space, form_changes: Callable[[], int]) -> None:
        self.space = space
        self._reader, self._form_changes = BodyReader(space), form_changes
        self._dts = array("d")  # arguments of the steps
        self.has_constant_step = True
        """whether all steps so far are of one length"""
        self._elapsed = 0.0
        self._is_stepping = self._has_callbacks = False
        elements = SpaceElements(space, {}, is_recorded=True)
        captured = scene_of(elements, PROVISIONAL_DT, 10.0, "")
        self._paths, self._joint_paths = elements.paths, elements.joint_paths
        self._wall_bodies = {
            shape.body for shape, path in elements.paths.items() if path.startswith(("wall[", "post["))
        }
        self._scene, self._names = captured.scene, elements.names
        self._omitted, self._inexact = dict.fromkeys(captured.omitted), dict.fromkeys(captured.inexact)
        self._actions: list[Action] = []
        self._states = {body: MotionState.of(body) for body in self._names}
        self._forces: dict[pymunk.Body, tuple[float, float, float]] = {}
        self._gravity, self._damping = tuple(space.gravity), space.damping
        bodies = captured.scene.bodies
        self._scene_bodies = set(bodies.names)
        self._dynamic = set(itertools.compress(bodies.names, ~bodies.immovable))
        self._moving = set(itertools.compress(bodies.names, ~bodies.fixed))
        self._unused: set[pymunk.Body] = set()  # bodies that nothing touches: they have sensors only
        self._set_in_step: set[pymunk.Body] = set()
        self._missing: set[pymunk.Body] = set()  # bodies that the game has added, and a scene cannot have
        self.first_missing: tuple[int, str] | None = None
        """step in which the space first has such a body, and its name"""
        self._not_finite: dict[str, None] = {}  # names of bodies for which pymunk has computed such values
        self._form, self._seen_changes = SpaceForm.of(space, self._names), form_changes()
        self._scene_joints = {joint: form for joint, form in self._form.joints.items() if joint in self._joint_paths}
        self.log = StateLog()
        """states after each step"""
        self.log.eccentric |= {body for body in self._names if any(body.center_of_gravity)}

    def before_step(self, dt: float) -> None:
        """Note what the game has changed since the physics of the last step.

        Args:
            dt: argument of the step, s; not 0.
        """
        if len(self._actions) > MAX_ACTIONS:
            self._omitted[f"actions after the first {MAX_ACTIONS:,}"] = None
        else:
            states = self._note_changes()
            self._note_forces(states)
        self._dts.append(dt)
        self.has_constant_step &= dt == self._dts[0]
        self._set_in_step = {
            body for body, name in self._names.items() if _has_functions(body) or self._has_other_type(body, name)
        }
        self._set_in_step |= self._bodies_of_other_joints() & self._names.keys()
        self._is_stepping = True

    def after_physics(self, has_callbacks: bool) -> None:
        """Note the state after the physics of a step; callbacks after it act as the game between two steps.

        Args:
            has_callbacks: whether something is left to do in the step: bodies to add or remove, post-step callbacks.
        """
        if not self._is_stepping:
            return
        self._is_stepping = False
        self._has_callbacks = has_callbacks
        dt = self._dts[-1]
        self._elapsed = self.steps * dt if self.has_constant_step else self._elapsed + dt
        self._states = {body: state.motion for body, state in self._reader.read(self._names).items()}
        self.log.add(self.steps, self._logged(), self._states, self._set_in_step)

    def _has_other_type(self, body: pymunk.Body, name: str) -> bool:
        """Return whether a body has another type, static, kinematic or dynamic, than in the scene."""
        in_scene = pymunk.Body.STATIC
        if name in self._moving:
            in_scene = pymunk.Body.DYNAMIC if name in self._dynamic else pymunk.Body.KINEMATIC
        return name in self._scene_bodies and body.body_type != in_scene

    def _bodies_of_other_joints(self) -> set[pymunk.Body]:
        """Return the bodies of joints that are not as in the scene: added, removed or changed by the game."""
        scene, now = self._scene_joints, self._form.joints
        if now == scene:
            return set()
        others = (joint for joint in now.keys() | scene.keys() if now.get(joint) != scene.get(joint))
        return {body for joint in others for body in (joint.a, joint.b)}

    def _logged(self) -> dict[pymunk.Body, str]:
        return {body: name for body, name in self._names.items() if name in self._scene_bodies}

    def after_step(self) -> None:
        """Note what callbacks have changed in a step; at its end, as the game may end with it."""
        self.after_physics(has_callbacks=False)
        if (self._has_callbacks or self._set_in_step) and len(self._actions) <= MAX_ACTIONS:
            self._note_changes()
            self.log.amend(self._logged(), self._states)

    def note_set(self, body: pymunk.Body) -> None:
        """Note that the motion of a body is set; within the physics of a step only a callback can do so."""
        if self._is_stepping:
            self._set_in_step.add(body)

    def omit(self, remark: str) -> None:
        """Note something that the recording lacks."""
        self._omitted[remark] = None

    @property
    def steps(self) -> int:
        """Steps so far, without those of length 0."""
        return len(self._dts)

    @property
    def time(self) -> float:
        """Time of the next step, s."""
        return self._elapsed

    @property
    def dt(self) -> float:
        """The median step, s."""
        return median_low(self._dts)

    def _note_changes(self) -> dict[pymunk.Body, BodyState]:
        """Note what the game has changed since the physics of the last step, and return the states of all bodies."""
        space = self.space
        if tuple(space.gravity) != self._gravity:
            self._gravity = tuple(space.gravity)
            self._act(SetParameter, path="world.gravity", value=list(self._gravity))
        if space.damping != self._damping:
            self._damping = space.damping
            if 0.0 < space.damping <= 1.0:
                self._act(SetParameter, path="world.damping", value=space.damping)
            else:
                self._omitted[
                    f"space.damping = {space.damping:g}, which the game sets; `world.damping` is above 0 and at most 1"
                ] = None
        if self.steps and self._form_changes() != self._seen_changes:
            self._note_form()
        states = self._reader.read(self._names)
        if self.steps:
            self._note_motion(states)
        return states

    def _note_form(self) -> None:
        """Note what has changed in the space besides the motion of its bodies."""
        form, known, joints = SpaceForm.of(self.space, self._names), dict(self._names), self._scene_joints
        self._note_population()
        exchanged = known.keys() ^ self._names.keys()
        self._omitted |= dict.fromkeys(form.changes_since(self._form, exchanged | self._missing, known, joints))
        self._note_coefficients(form)
        self._note_motors(form)
        self._form = form if not exchanged else SpaceForm.of(self.space, self._names)
        self._seen_changes = self._form_changes()

    def _act(self, kind: Callable[..., Action], **values: Any) -> None:
        """Add an action at the present time; one with values that a scene cannot have is a remark."""
        try:
            self._actions.append(kind(time=self.time, **values))
        except PartError as error:
            what, fault = values.get("body") or values.get("path"), error.faults[0]
            self._omitted[f"values of {what} that the game sets ({fault.path}: {fault.message})"] = None

    def _note_population(self) -> None:
        """Note bodies that were added or removed. Bodies without shapes and joints are not used."""
        present = [body for body in self.space.bodies if body.shapes or body in self._names]
        for body in self._form.bodies.keys() - {*self.space.bodies, self.space.static_body}:
            name = self._names.pop(body)
            self._paths = {shape: path for shape, path in self._paths.items() if shape.body is not body}
            self._scene_joints = {
                joint: form for joint, form in self._scene_joints.items() if body not in (joint.a, joint.b)
            }
            if name in self._scene_bodies:
                self._act(Remove, body=name)
            else:
                self._omitted["walls and posts that the game removes"] = None
        added = [body for body in present if body not in self._names and body not in self._unused]
        if not added:
            return
        given = self._names | {body: f"added-{self.steps}-{k}" for k, body in enumerate(added, 1)}
        elements = SpaceElements(self.space, given, is_recorded=True)
        self._unused |= set(added) - elements.names.keys()
        for body in (body for body in added if body in elements.names):
            self._note_added(body, elements)
        self._omitted |= dict.fromkeys(elements.omitted)
        self._inexact |= dict.fromkeys(elements.inexact)

    def _note_added(self, body: pymunk.Body, elements: SpaceElements) -> None:
        """Note a body that was added."""
        try:
            table, values = elements.element_of(body)
            spawned = {"time": self.time, "kind": "spawn", table: values}
            action = Spawn.model_validate_json(json.dumps(spawned))
        except ValueError as error:  # a CaptureError, or values that a scene cannot have
            reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
            self._omitted[f"a body that the game adds and a scene cannot have: {reason}"] = None
            self._unused.add(body)
            self._missing.add(body)
            self.first_missing = self.first_missing or (self.steps + 1, elements.names[body])
            return
        self._actions.append(action)
        name = str(values["name"])
        if table == "ball" and not values.get("friction") and not values.get("fixed_rotation"):
            self._inexact[NOT_TURNED] = None
        if table == "ball":  # the parts of an added body have no paths
            self._paths |= dict.fromkeys(body.shapes, f"ball.{quoted(name)}")
        self._names[body], self._states[body] = name, MotionState.of(body)
        self._scene_bodies.add(name)
        if any(body.center_of_gravity):
            self.log.eccentric.add(body)
        if not values.get("fixed"):
            self._moving.add(name)
            if not values.get("kinematic"):
                self._dynamic.add(name)

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
        for key, value in now.items():
            if value != before[key]:
                self._act(SetParameter, path=f"{path}.{key}", value=value)

    def _note_motion(self, states: Mapping[pymunk.Body, BodyState]) -> None:
        """Note bodies whose motion is not that after the physics of the last step, or was set within it."""
        for body, name in self._names.items():
            before, now = self._states[body], states[body].motion
            was_set = (
                body in self._set_in_step
                and (name in self._moving or self._has_other_type(body, name))
                and not body.is_sleeping
            )
            if before == now and not was_set:
                continue
            self._states[body] = now
            if not now.is_finite:
                self._not_finite[name] = None
                continue
            if name not in self._scene_bodies or body in self._wall_bodies:
                if before != now:
                    self._omitted["walls and posts that the game moves"] = None
                continue
            is_moving = name in self._moving
            if not is_moving and now.velocity != before.velocity and not was_set:
                self._omitted[f"the velocity of {name}, which is fixed in the scene"] = None
            x, y = body.local_to_world(body.center_of_gravity) if any(body.center_of_gravity) else now.position
            values: dict[str, Any] = {"body": name, "position": (x, y)}
            if was_set or now.angle != before.angle:
                values["angle"] = now.angle
            if is_moving and (was_set or now.velocity != before.velocity):
                values["velocity"] = now.velocity
            if is_moving and (was_set or now.angular_velocity != before.angular_velocity):
                values["angular_velocity"] = now.angular_velocity
            self._act(Move, **values)
        self._set_in_step = set()

    def _note_forces(self, states: Mapping[pymunk.Body, BodyState]) -> None:
        """Note forces that the game applies for the next step, where they differ from those of the last one."""
        for body, name in self._names.items():
            force = states[body].force
            if force == self._forces.get(body, NO_FORCE):
                continue
            if body.body_type == pymunk.Body.DYNAMIC and name in self._dynamic:
                self._forces[body] = force
                self._act(Force, body=name, force=(force[0], force[1]), torque=force[2])

    def recording(self) -> Recording:
        """Return the recording so far.

        Its step is the median of the game's, and its settings are those that the scene states: others, such as pymunk's
        persistence, are left to the engine, so that other engines can replay it too.

        Raises:
            CaptureError: the median step is out of the range of scenes.
        """
        dt = self.dt
        try:
            settings = self._scene.solver.replace(dt=dt)
        except SettingsError as error:
            raise CaptureError(str(error)) from error
        duration = max(self.time, dt) if self.has_constant_step else max(round(self.time / dt), 1) * dt
        scene = self._scene.model_copy(update={"solver": settings})
        end = self.log.last
        states = {} if end is None else dict(zip(end.names, end.states.tolist(), strict=True))
        ends = {name: tuple(map(finite, row)) for name, row in states.items()}
        game = RecordedGame(self.omitted, self.inexact, ends)
        return Recording(scene, "pymunk", settings, tuple(self._actions), duration, game=game)

    @property
    def names(self) -> dict[pymunk.Body, str]:
        """Names of the bodies in the scene and the actions."""
        return dict(self._names)

    @property
    def omitted(self) -> tuple[str, ...]:
        """What scene and actions lack."""
        found = list(self._omitted)
        if not self.has_constant_step:
            low, high = (1e3 * bound(self._dts) for bound in (min, max))
            median = f"the recording has the median, {1e3 * self.dt:.4g} ms"
            found.insert(0, f"the step, which varies from {low:.4g} to {high:.4g} ms; {median}")
        if self._not_finite:
            count = len(self._not_finite)
            bodies = next(iter(self._not_finite)) if count == 1 else f"{count} bodies"
            found.append(f"the motion of {bodies} after pymunk has computed values for it that are not finite")
        return tuple(found)

    @property
    def inexact(self) -> tuple[str, ...]:
        """Reasons for which a replay may differ by rounding."""
        return tuple(self._inexact)


def _has_functions(body: pymunk.Body) -> bool:
    """Return whether functions of the game compute the motion of a body."""
    return getattr(body, "_velocity_func", None) is not None or getattr(body, "_position_func", None) is not None


class GameCapture:
    """All spaces that a game steps."""

    def __init__(self) -> None:
        self._captures: dict[pymunk.Space, SpaceCapture] = {}
        self._refused: dict[pymunk.Space, CaptureError] = {}
        self._steps: dict[pymunk.Space, int] = {}
        self.form_changes = 0
        """changes of what a space is, besides the motion of its bodies, in all spaces"""

    def step(self, space: pymunk.Space, dt: float) -> SpaceCapture | None:
        """Note the changes before a step of a space; None for a space that cannot be a scene."""
        self._steps[space] = self._steps.get(space, 0) + 1
        if space not in self._captures and space not in self._refused:
            try:
                self._captures[space] = SpaceCapture(space, lambda: self.form_changes)
            except CaptureError as error:
                self._refused[space] = error
        found = self._captures.get(space)
        if found is not None:
            found.before_step(dt)
        return found

    def note_physics_end(self, space: pymunk.Space, has_additions: bool) -> None:
        """Note that the physics of a step has ended, if it had not before.

        Args:
            space: the space.
            has_additions: whether callbacks have added something.
        """
        found = self._captures.get(space)
        if found is not None and not space._locked:
            found.after_physics(has_additions or bool(space._remove_later or space._post_step_callbacks))

    def note_form_change(self) -> None:
        """Note that something in a space changes besides the motion of its bodies."""
        self.form_changes += 1

    def note_set(self, body: pymunk.Body) -> None:
        """Note that the motion of a body is set."""
        space = body.space
        if space is not None and space in self._captures:
            self._captures[space].note_set(body)

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
        return max(self._steps.values(), default=0)

    @property
    def recording(self) -> Recording:
        """Recording of the space that made the most steps.

        Raises:
            ValueError: no space has made a step.
            CaptureError: that space cannot be a scene.
        """
        return self._longest.recording()

    @property
    def log(self) -> StateLog:
        """States of the bodies of that recording after each step."""
        return self._longest.log

    @property
    def first_missing(self) -> tuple[int, str] | None:
        """Step in which that space first has a body that a scene cannot have, and the name of the body."""
        return self._longest.first_missing

    @property
    def has_constant_step(self) -> bool:
        """Whether all steps of that space are of one length."""
        return self._longest.has_constant_step

    @property
    def omitted(self) -> tuple[str, ...]:
        """What that recording lacks."""
        return self._longest.omitted

    @property
    def inexact(self) -> tuple[str, ...]:
        """Reasons for which a replay may differ from the game by rounding."""
        return self._longest.inexact

    @property
    def _longest(self) -> SpaceCapture:
        if not self._steps:
            raise ValueError("no pymunk space has made a step")
        space = max(self._steps, key=self._steps.__getitem__)
        if space in self._refused:
            raise self._refused[space]
        return self._captures[space]


class StepLimitReached(SystemExit):
    """Ends a game that has made the wanted number of steps."""


@contextmanager
def capture(max_steps: int | None = None) -> Iterator[GameCapture]:
    """Record all pymunk spaces that are stepped within a `with` block.

    Args:
        max_steps: steps of a space after which the next one raises `StepLimitReached`; default: unlimited.

    Yields:
        The recordings, which grow with each step.

    Example:
        >>> import pymunk
        >>> space = pymunk.Space()
        >>> space.add(ball := pymunk.Body(1.0, 0.1), pymunk.Circle(ball, 0.5))
        >>> with sandbox.capture() as game:
        ...     for _ in range(10):
        ...         space.step(1 / 60)
        >>> game.steps, game.recording.scene.solver.dt
        (10, 0.016666666666666666)
    """
    game, step, add = GameCapture(), pymunk.Space.step, pymunk.Space.add

    def watched(space: pymunk.Space, dt: float) -> None:
        if dt == 0.0:  # pymunk makes no step then
            step(space, dt)
            return
        if max_steps is not None and game.steps >= max_steps:
            raise StepLimitReached(0)
        found = game.step(space, dt)
        step(space, dt)
        if found is not None:
            found.after_step()

    def added(space: pymunk.Space, *objects: Any) -> None:
        # pymunk calls it after the physics of a step, before it removes bodies and calls post-step callbacks
        game.note_physics_end(space, bool(objects))
        if objects:
            game.note_form_change()
        add(space, *objects)

    with ExitStack() as stack:
        stack.enter_context(_replaced(pymunk.Space, "step", watched))
        stack.enter_context(_replaced(pymunk.Space, "add", added))
        for name in ("activate", "sleep", "sleep_with_group"):
            stack.enter_context(_replaced(pymunk.Body, name, _noted(game.note_sleep, getattr(pymunk.Body, name))))
        for name in ("apply_impulse_at_world_point", "apply_impulse_at_local_point"):
            stack.enter_context(_replaced(pymunk.Body, name, _noted(game.note_set, getattr(pymunk.Body, name))))
        for name in ("position", "velocity", "angle", "angular_velocity"):
            own: property = getattr(pymunk.Body, name)
            assert own.fset is not None
            noted = own.setter(_noted(game.note_set, own.fset))
            stack.enter_context(_replaced(pymunk.Body, name, noted))
        for owner, name, changing in _form_setters(game.note_form_change):
            stack.enter_context(_replaced(owner, name, changing))
        yield game


def _form_setters(note: Callable[[], None]) -> Iterator[tuple[type, str, Any]]:
    """Yield the setters and methods of pymunk that change the form of a space, with a note of each call."""
    for name in ("remove", "on_collision"):
        yield pymunk.Space, name, _after(note, getattr(pymunk.Space, name))
    joints = (each for each in vars(pymunk.constraints).values() if isinstance(each, type))
    for owner in (pymunk.Space, pymunk.Body, pymunk.Shape, pymunk.Circle, pymunk.Segment, pymunk.Poly, *joints):
        if not owner.__module__.startswith("pymunk."):
            continue
        for name, value in vars(owner).items():
            if isinstance(value, property) and value.fset is not None and name not in MOTION:
                yield owner, name, value.setter(_after(note, value.fset))


def _after(note: Callable[[], None], method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that is followed by a note."""

    def noted(*arguments: Any, **more: Any) -> Any:
        result = method(*arguments, **more)
        note()
        return result

    return noted


MOTION = frozenset({"position", "velocity", "angle", "angular_velocity", "force", "torque", "gravity", "damping"})
"""Attributes of bodies and spaces that are compared at each step, and are no part of the form of a space"""


def _noted(note: Callable[[pymunk.Body], None], method: Callable[..., None]) -> Callable[..., None]:
    """Return a method of bodies that is noted when the game calls it."""

    def noted(body: pymunk.Body, *arguments: Any, **more: Any) -> None:
        method(body, *arguments, **more)
        note(body)

    return noted


@contextmanager
def _replaced(owner: type, name: str, function: Any) -> Iterator[None]:
    """Replace a method or property of a class within a `with` block."""
    before = getattr(owner, name)
    setattr(owner, name, function)
    try:
        yield
    finally:
        setattr(owner, name, before)
