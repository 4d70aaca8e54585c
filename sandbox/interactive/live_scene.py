"""A live scene: a running simulation that is played, paused, dragged and changed. It knows no transport.

Time is request-driven: a front end asks for the state after some elapsed real time, and gets it after at most about
`MAX_WORK` of computing. If the steps need more, the scene falls behind real time, and reports its real speed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.action import Action, ActionError, Pull, SetParameter, Switch, is_settable
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.energy_balance import energy_of
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, able, engine_named, usual
from sandbox.engines.switching import SwitchableSimulation, switch_engine
from sandbox.interactive.ghost import Ghost, largest_distance
from sandbox.interactive.picture import Picture, find_view
from sandbox.interactive.sliders import default_sliders, parse_sliders, split_component, whole_values
from sandbox.report.colours import css_class_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import as_scene, from_document
from sandbox.step_clock import FixedStepClock, interpolate, speed_for
from sandbox.trajectory import Frame

MAX_WORK = 0.03
"""s, computing time of the steps of one request; the last step may exceed it"""
STEP_TIMEOUT = 2.0
"""s that one step may take to compute, on engines that can interrupt a step"""
SPEEDS = (0.001, 0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Speeds that a front end offers beside the present one, as multiples of real time."""
BEHIND = 0.9
"""Fraction of the selected speed below which the scene counts as behind."""
LATE_REQUESTS = 30
"""Requests for which a scene still counts as behind after one that could not make all steps: half a second."""


class LiveScene:
    """A scene on an engine, its sliders and its ghost; one or several viewers show and control it."""

    def __init__(
        self,
        scene: Scene | str | Path,
        engine: str | None = None,
        sliders: Sequence[str] | None = None,
        wall_clock: Callable[[], float] | None = None,
    ) -> None:
        """Start a scene, paused.

        Args:
            scene: the scene, or its name or path.
            engine: name of the engine; default: as in the window.
            sliders: each `KEY` or `KEY=LOW:HIGH[:log]`; default: gravity, dt, restitution and friction.
            wall_clock: returns the real time, s, and replaces the elapsed times that front ends state: several viewers
                of one scene would add theirs.

        Raises:
            SceneError: the scene is invalid.
            UnknownEngineError: no engine has that name.
            Refusal: the engine cannot run the scene.
            AddressError: a slider is invalid.
        """
        self._file = as_scene(scene)
        self.simulation = _start(self._file, usual(self._file) if engine is None else engine)
        settings = self.simulation.settings
        texts = default_sliders(self._file, settings) if sliders is None else sliders
        self._sliders = parse_sliders(texts, self._file, settings)
        self._values: dict[str, float] = {}  # set by sliders
        self._clock = FixedStepClock()
        self._clock.speed = self._file.play.speed or speed_for(self._file.world.duration)
        self._wall_clock, self._last_request = wall_clock, 0.0 if wall_clock is None else wall_clock()
        self._late = 0  # requests for which it still counts as behind
        self._ghost: Ghost | None = None
        self.playing = False
        """whether elapsed time advances the scene"""
        self._ended: str | None = None
        self.revision = 0
        """number of changes of what `state` returns"""
        self.picture_revision = 0
        """number of changes of `picture`"""
        self.picture = Picture(self._file, find_view(self._file, self.simulation.engine, self.simulation.wanted))
        self._before: Frame = self.simulation.frame()  # drawn are states between these two
        self._after: Frame = self._before

    # --- Time ----------------------------------------------------------------------------------------------------

    def advance(self, elapsed: float) -> None:
        """Make the steps that are due after elapsed real time, s; with a wall clock, since the last call."""
        if self._wall_clock is not None:
            elapsed, self._last_request = self._wall_clock() - self._last_request, self._wall_clock()
        if not self.playing:
            return
        dt, compiled = self.simulation.settings.dt, COMPILE_CLOCK.seconds
        due = self._clock.steps_due(max(elapsed, 0.0), dt)
        made = self._make_steps(due, MAX_WORK)
        if COMPILE_CLOCK.seconds > compiled:  # compilation is no part of the speed of the scene
            self._clock.reset()
        else:
            self._clock.record_steps(elapsed, made, due, dt)
            self._late = LATE_REQUESTS if made < due else max(self._late - 1, 0)

    def step(self, count: int) -> None:
        """Pause, and make some steps; fewer if they take longer than `STEP_TIMEOUT`."""
        self.play(False)
        self._make_steps(count, STEP_TIMEOUT)
        self._before = self._after

    def _make_steps(self, count: int, budget: float) -> int:
        """Make steps, for a computing time, s, at most, without compilation; return how many were made."""
        made, until, compiled = 0, perf_counter() + budget, COMPILE_CLOCK.seconds
        try:
            while made < count and self._ended is None:
                self._before = self._after
                self.simulation.step()
                self._after = self.simulation.frame()
                made += 1
                if self._ghost is not None:
                    self._follow(self._ghost)
                if perf_counter() > until + COMPILE_CLOCK.seconds - compiled:
                    break
        except (Divergence, Exhaustion) as error:
            self._ended, self.playing = str(error), False
            self._after = self.simulation.frame()
            self.revision += 1
        return made

    def _follow(self, ghost: Ghost) -> None:
        ended = ghost.ended
        ghost.follow(self._after.time, STEP_TIMEOUT)
        self.revision += ghost.ended != ended

    def play(self, on: bool) -> None:
        """Play or pause."""
        if on != self.playing and not (on and self._ended is not None):
            self.playing = on
            self._clock.reset()
            if self._wall_clock is not None:
                self._last_request = self._wall_clock()
            self._before = self._after
            self.revision += 1

    def set_speed(self, speed: float) -> None:
        """Set the speed, as a multiple of real time."""
        self._clock.speed = speed
        self.revision += 1

    def reset(self) -> str | None:
        """Start the scene again, with the values of the sliders; return the reason if its ghost cannot.

        Raises:
            ActionError: the scene cannot be started with them. Nothing has changed then.
        """
        return self._restart(self._values)

    def _restart(self, values: dict[str, float]) -> str | None:
        try:
            scene = self._file
            if values:
                overrides = whole_values(scene, self.simulation.settings, values)
                scene = from_document(to_document(scene), overrides=overrides.items())
            simulation = _start(scene, self.simulation.engine)
        except (SceneError, Refusal) as error:
            raise ActionError(str(error)) from None
        self.simulation.close()
        self.simulation, self._values, self._ended = simulation, values, None
        picture = Picture(scene, self.picture.view)
        if picture.document() != self.picture.document():
            self.picture = picture
            self.picture_revision += 1
        self._clock.reset()
        self._before = self._after = self.simulation.frame()
        self.revision += 1
        if self._ghost is not None:
            try:
                self.set_ghost(self._ghost.engine, self._ghost.dt_fraction)
            except ActionError as error:
                return f"no ghost: {error}"
        return None

    # --- Changes -------------------------------------------------------------------------------------------------

    def apply(self, action: Action) -> None:
        """Apply an action to the scene and to its ghost.

        Raises:
            ActionError: the engine refuses it. Nothing has changed then.
        """
        self.simulation.apply(action)
        if self._ghost is not None:
            self._ghost.apply(action)
        if not isinstance(action, Pull):
            self._before = self._after = self.simulation.frame()

    def set_value(self, key: str, value: float) -> str | None:
        """Set the value of a slider: in the running scene if that is possible, else the scene starts again.

        Returns:
            The reason if the scene starts again and its ghost cannot.

        Raises:
            ActionError: there is no such slider, or the value is out of range or refused. Nothing has changed then.
        """
        slider = self._sliders.get(key)
        if slider is None:
            raise ActionError(f"no slider has the key {key[:80]!r}")
        try:
            checked = slider.checked(value)
        except ValueError as error:
            raise ActionError(str(error)) from None
        values = {**self._values, key: checked}
        message = None
        if key.startswith("solver."):
            self.apply(Switch(time=0.0, settings={key.removeprefix("solver."): checked}))
        elif is_settable(split_component(key)[0]):
            message = self._set_live(key, checked, values)
        else:
            message = self._restart(values)
        self._values = values
        self._sliders[key] = replace(slider, value=checked)
        self.revision += 1
        return message

    def _set_live(self, key: str, value: float, values: dict[str, float]) -> str | None:
        """Set a parameter of the running scene; start it again if the engine cannot."""
        ((path, whole),) = whole_values(self.simulation.scene, self.simulation.settings, {key: value}).items()
        try:
            self.apply(SetParameter(time=0.0, path=path, value=whole))
        except ActionError:
            return self._restart(values)
        return None

    def set_engine(self, name: str) -> str | None:
        """Continue with another engine from the present state; return a message on settings that it chooses itself.

        Raises:
            ActionError: the engine cannot continue from here. Nothing has changed then.
        """
        message = switch_engine(self.simulation, name)
        self._before = self._after = self.simulation.frame()
        self.revision += 1
        return message

    def set_ghost(self, engine: str | None, dt_fraction: float) -> None:
        """Start a ghost from the present state, or end it.

        Raises:
            ActionError: its engine cannot continue from here. There is no ghost then.
        """
        self._end_ghost()
        self.revision += 1
        if engine is not None:
            self._ghost = Ghost(self.simulation, engine, dt_fraction)

    def _end_ghost(self) -> None:
        if self._ghost is not None:
            self._ghost.close()
            self._ghost = None

    # --- Documents -----------------------------------------------------------------------------------------------

    @property
    def frame(self) -> Frame:
        """The present state, after the last step."""
        return self._after

    def frame_document(self) -> dict[str, Any]:
        """Return what changes in each frame as JSON: time, poses, energies, broken joints, the ghost, the real speed.

        The poses lie between the last two steps.
        """
        simulation = self.simulation
        shown = interpolate(self._before, self._after, self._clock.alpha(simulation.settings.dt) if self.playing else 1)
        document: dict[str, Any] = {"time": shown.time, "pose": self.picture.pose(shown), "energy": self._energy()}
        if simulation.broken:
            document["breaks"] = {str(k): time for k, time in simulation.broken.items()}
        if self._ghost is not None and self._ghost.ended is None:
            ghost = self._ghost.frame_at(shown.time)
            document["ghost"] = {"pose": self.picture.pose(ghost), "distance": largest_distance(shown, ghost)}
        if self.playing and self._late and self._clock.real_speed < BEHIND * self._clock.speed:
            document["real_speed"] = self._clock.real_speed
        return document

    def _energy(self) -> list[float] | None:
        """Return the kinetic and the potential energy, J; None if they are not finite."""
        setup, broken = self.simulation.setup, self.simulation.broken
        breaks = np.full(len(setup.joints), np.inf)
        breaks[list(broken)] = list(broken.values())
        gravity = setup.scene.world.gravity
        kinetic, potential, total = energy_of(self._after, self.simulation.bodies, gravity, setup, breaks)
        return [kinetic, potential] if math.isfinite(total) else None

    def state(self) -> dict[str, Any]:
        """Return what the controls show as JSON: engine, speed, sliders, ghost, and the reason of an end."""
        simulation = self.simulation
        runnable = (simulation.engine, *able(simulation.setup, simulation.wanted.common()))
        return {
            "playing": self.playing,
            "is_shared": self._wall_clock is not None,
            "speed": self._clock.speed,
            "speeds": sorted({*SPEEDS, self._clock.speed}),
            "ended": self._ended,
            "engine": simulation.engine,
            "dt": simulation.settings.dt,
            "has_steps": simulation.settings.integrator is not None,
            "engines": [
                {
                    "name": name,
                    "is_able": name in runnable,
                    "css_class": css_class_of(name),
                }
                for name in ENGINES
            ],
            "ghost": None if self._ghost is None else self._ghost.document(),
            "sliders": [
                {
                    "key": slider.key,
                    "value": slider.value,
                    "low": slider.range.low,
                    "high": slider.range.high,
                    "is_log": slider.range.is_log,
                    "is_whole": slider.range.is_whole,
                    "unit": slider.unit,
                }
                for slider in self._sliders.values()
            ],
        }

    def close(self) -> None:
        """Release the resources of all engines."""
        self._end_ghost()
        self.simulation.close()


def _start(scene: Scene, engine: str) -> SwitchableSimulation:
    """Start a scene; settings that only another engine knows get their defaults.

    Raises:
        UnknownEngineError: no engine has that name.
        Refusal: the engine cannot run the scene.
    """
    engine_named(engine)
    try:
        simulation = SwitchableSimulation(scene, engine)
    except Refusal as refusal:
        try:
            simulation = SwitchableSimulation(scene, engine, scene.solver.common())
        except Refusal:
            raise refusal from None
    simulation.patience = STEP_TIMEOUT
    return simulation
