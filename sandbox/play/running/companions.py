"""Companions: runs beside the session, from the same state by the same actions: the ghost and the twin.

The ghost is the scene as another engine has it, the twin the scene with every
body moved by 1e-12 m. Each begins where the session is when it is asked for; while the session goes back, it waits.
"""

from collections.abc import Collection
from dataclasses import replace
from time import perf_counter

import numpy as np

from sandbox.action import Action, ActionError, Switch
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.segment import Checkpoint
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.compare.errors import usual_tolerance
from sandbox.measure.compare.horizon import perturb
from sandbox.scene.description.world import COMMON
from sandbox.trajectory import Frame

PATIENCE = 0.3
"""s that the steps of a companion may take to compute for one picture."""


class Companion:
    """A run beside a session. Where it fails it ends, and says why; the session goes on."""

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start.

        Args:
            point: where the session is.
            step: how many steps that has made.

        Raises:
            Refusal: its engine cannot begin from there.
            ActionError: it cannot take over a steady force.
        """
        self.step = step
        """of the session, up to which it has come"""
        self.relay = SwitchableSimulation.resumed(point)
        self.relay.patience = PATIENCE
        self.frame: Frame | None = self.relay.frame()
        self.begun = point.frame.time
        """s"""
        self.ended: str | None = None

    @property
    def engine(self) -> str:
        """Its engine's name."""
        return self.relay.engine

    def act(self, action: Action) -> None:
        """Do what the session does; it keeps its own engine."""
        if self.ended is None:
            try:
                self.relay.apply(action)
                self.frame = self.relay.frame()
            except ActionError as error:
                self._end(str(error))

    def follow(self, step: int) -> None:
        """Make steps up to one of the session; where it has been there, it waits."""
        steps, self.step = step - self.step, max(step, self.step)
        until, compiled = perf_counter() + PATIENCE, COMPILE_CLOCK.seconds
        if self.ended is not None or steps <= 0:
            return
        try:
            for _ in range(steps):
                self.relay.step()
                if perf_counter() > until + COMPILE_CLOCK.seconds - compiled:
                    raise Exhaustion(f"{self.engine} is too slow to keep up")
            self.frame = self.relay.frame()
        except (Divergence, Exhaustion) as error:
            self._end(str(error))

    def _end(self, why: str) -> None:
        self.ended, self.frame = why, None

    def close(self) -> None:
        """Release what its engine holds."""
        self.relay.close()


def ghost_of(point: Checkpoint, step: int = 0, without: Collection[str] = ()) -> tuple[Companion, str]:
    """Return the ghost of a session, and what is to be said of it: `exact` where it can, else another engine.

    Args:
        point: where the session is.
        step: how many steps that has made.
        without: engines that have been tried already.

    Raises:
        ActionError: no other engine can go on from here.
    """
    why: list[str] = []
    for name in ("exact", "reference", "pymunk", *ENGINES):
        if name == point.engine or name in without or name not in ENGINES:
            continue
        try:
            return Companion(replace(point, engine=name, wanted=point.wanted.common()), step), "; ".join(why)
        except (Refusal, ActionError) as refusal:
            why.append(str(refusal))
    raise ActionError("; ".join(why) or "no other engine is available")


class Trust:
    """Whether what is seen can still be trusted: a twin, moved by 1e-12 m at first, is still at the same places.

    Past that horizon what is seen is one of many things that might as well have happened: the scene is chaotic, or
    the nudge decides in which step an engine that looks at steps alone sees a contact.
    """

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start the twin.

        Args:
            point: where the session is.
            step: how many steps that has made.

        Raises:
            Refusal: the engine cannot begin from there.
            ActionError: it cannot take over a steady force.
        """
        self.tolerance = usual_tolerance(point.scene)
        self.time = point.frame.time
        """s, what the session shows"""
        self.horizon: float | None = None
        """s, when the two had come apart; known as long as the session goes the same way"""
        self.spread: float | None = None
        perturbed = _perturbed(point)
        self.able = perturbed is not None
        """whether anything can grow at all"""
        self._twin = Companion(perturbed, step) if perturbed is not None else None

    @property
    def step(self) -> int:
        """Step of the session up to which the twin has come; 0 where there is none."""
        return self._twin.step if self._twin is not None else 0

    def act(self, action: Action) -> None:
        """Do what the session does."""
        if self._twin is not None:
            self._twin.act(action)

    def follow(self, step: int) -> None:
        """Let the twin make steps up to one of the session."""
        if self._twin is not None:
            self._twin.follow(step)

    def look(self, frame: Frame, step: int) -> None:
        """Look how far the session, which shows this after so many steps, and the twin have come apart."""
        self.time = frame.time
        if self._twin is None or self.horizon is not None or step != self._twin.step:
            return
        if self._twin.frame is None:
            self._twin.close()
            self._twin = None
            return
        self.spread = apart(frame, self._twin.frame)
        if self.spread is None or not self.spread <= self.tolerance:
            self.horizon = frame.time

    @property
    def state(self) -> str:
        """`trusted`, `lost`, or `unknown`."""
        if self.horizon is not None:
            return "lost" if self.time >= self.horizon else "trusted"
        return "trusted" if self._twin is not None or not self.able else "unknown"

    def close(self) -> None:
        """Release what its engine holds."""
        if self._twin is not None:
            self._twin.close()


def apart(a: Frame, b: Frame) -> float | None:
    """Return the largest distance between a body in one frame and in the other, m; None where none is in both."""
    known = min(len(a.position), len(b.position))
    both = a.present[:known] & b.present[:known]
    with np.errstate(all="ignore"):
        distance = np.hypot(*(a.position[:known][both] - b.position[:known][both]).T)
    return float(distance.max()) if len(distance) else None


def _perturbed(point: Checkpoint) -> Checkpoint | None:
    """Return the moment with every body that can meet something moved a little (`perturb`); None without any."""
    frame, there = point.frame, point.frame.present
    moved = perturb(point.present_setup())
    if moved is None:
        return None
    state = {key: getattr(frame, key).copy() for key in ("position", "velocity", "angle")}
    for key, array in state.items():
        array[there] = getattr(moved.bodies, key)
    return replace(point, frame=replace(frame, **state))


def follows(action: Action) -> Action | None:
    """Return a session's action as the ghost does it: the session's engine is not its own."""
    if not isinstance(action, Switch):
        return action
    shared = {key: value for key, value in action.settings.items() if key in COMMON}
    return Switch(time=action.time, settings=shared) if shared else None
