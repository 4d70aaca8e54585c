"""Follower: a second simulation of a session, which repeats its steps and actions a short way behind it.

An engine that cannot copy its state, such as pymunk, continues exactly only from the start of the run. A session that
steps back takes over its follower, which lies before the wanted step, and replays the steps between the two. They are
few, however long the session has been played. The follower has the same start and the same actions as the session, so
that its states are the same, bit for bit.
"""

from collections.abc import Sequence
from time import perf_counter

from sandbox.action import Action, ActionError
from sandbox.engines.contract import Divergence, Exhaustion, Refusal, SnapshotError
from sandbox.engines.switching import SwitchableSimulation
from sandbox.frame_table import FrameTable
from sandbox.games.contract import Press
from sandbox.games.session import GameSession
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.window.playback.action_log import due_actions
from sandbox.window.playback.history import Keyframe

MAX_DELAY = 0.05
"""s, computation time of the steps between a follower and its session"""
MIN_LAG = 64
"""steps that a follower stays behind its session, so that several steps back need no replay from the start"""
MIN_FOLLOWED = 256
"""steps from the start from which on a session has a follower"""
MAX_BODIES_IN_PLAY = 300
"""bodies up to which a follower is started while the session plays; with more, its start would show as a jerk"""
BATCH_TIME = 0.002
"""s, aimed computation time of one batch of steps"""
MAX_BATCH = 512
"""steps"""


class Follower:
    """A simulation that repeats a session from its start."""

    def __init__(
        self, start: tuple[Scene, str, Settings | None], actions: Sequence[Action], game: GameSession | None
    ) -> None:
        """Start at time 0.

        Args:
            start: scene, engine and settings of the session.
            actions: actions of the session up to now.
            game: the game of the session at its start.

        Raises:
            Refusal: the engine cannot run the scene.
        """
        self.simulation = SwitchableSimulation(*start)
        self.game = None if game is None else game.copy()
        self.step, self.done = 0, 0
        self.is_usable = True
        """False once a step or an action has failed"""
        self._seconds_per_step = 0.0
        self._run_rules(actions)

    @property
    def lag(self) -> int:
        """Number of steps that take `MAX_DELAY` s."""
        if not self._seconds_per_step:
            return MIN_LAG
        return max(round(MAX_DELAY / self._seconds_per_step), MIN_LAG)

    def advance(self, step: int, actions: Sequence[Action], presses: Sequence[Press], until: float) -> None:
        """Repeat the session up to a step, which it has passed, or until a time (`perf_counter`, s).

        Args:
            step: last step.
            actions: all actions of the session.
            presses: all inputs of its game.
            until: s.
        """
        if self.game is not None:
            self.game.set_presses(presses)
        while self.is_usable and self.step < step and (now := perf_counter()) < until:
            first = self.step
            try:
                self._make_steps(step, actions)
            except (Divergence, Exhaustion, ActionError):
                self.is_usable = False
                return
            spent = (perf_counter() - now) / max(self.step - first, 1)
            self._seconds_per_step += 0.1 * (spent - self._seconds_per_step) if self._seconds_per_step else spent

    def _make_steps(self, step: int, actions: Sequence[Action]) -> None:
        """Make some steps, up to the time of the next action at most, and apply the actions due then."""
        if self.game is not None:
            self.simulation.step()
            self.step += 1
        else:
            count = advance_batch(self.simulation, self._batch(step), next_action_time(actions, self.done))
            self.step += count
        self._run_rules(actions)

    def _batch(self, step: int) -> int:
        wanted = round(BATCH_TIME / self._seconds_per_step) if self._seconds_per_step else 1
        return min(step - self.step, max(wanted, 1), MAX_BATCH)

    def _run_rules(self, actions: Sequence[Action]) -> None:
        """Show the state to the rules of the game, and apply the actions of the present time."""
        simulation, due = self.simulation, due_actions(self.simulation, actions, self.done)
        if self.game is not None:
            own = self.game.on_step(simulation.time, simulation.frame(), simulation.contacts())
            self.game.replay(simulation.time, own, due)
        try:
            for action in due:
                simulation.apply(action)
                self.done += 1
        except ActionError:
            self.is_usable = False

    def close(self) -> None:
        """Release the resources of the engine."""
        self.simulation.close()


def advance_batch(simulation: SwitchableSimulation, steps: int, before: float | None) -> int:
    """Make steps without reading their states, which pymunk does several times faster; return how many were made.

    Args:
        simulation: simulation.
        steps: how many, at most, > 0.
        before: s, time of the next action, at which the last step ends at the latest; None if there is none.

    Raises:
        Divergence, Exhaustion: as `SwitchableSimulation.step`; the number of steps is lost.
    """
    dt = simulation.settings.dt
    if before is not None:  # one step less than fit: times of steps and of actions are rounded
        steps = max(min(steps, int((before - simulation.time) / dt) - 1), 1)
    table = FrameTable(1, len(simulation.bodies), every=steps + 1)
    if steps > 1:
        simulation.advance(steps, table)
    if table.steps:
        return table.steps
    simulation.step()
    return 1


def next_action_time(actions: Sequence[Action], done: int) -> float | None:
    """Return the time, s, of the first action that is not applied yet; None if there is none."""
    return actions[done].time if done < len(actions) else None


class FollowerSlot:
    """The follower of a session, while it has one."""

    def __init__(self, start: tuple[Scene, str, Settings | None], game: GameSession | None) -> None:
        """Start without a follower; scene, engine, settings and game are those of the session at its start."""
        self._start, self._game = start, game
        self._follower: Follower | None = None
        self._makes_snapshots: dict[str, bool] = {}  # by engine

    def advance(
        self,
        step: int,
        simulation: SwitchableSimulation,
        actions: Sequence[Action],
        presses: Sequence[Press],
        until: float,
        *,
        is_idle: bool,
    ) -> None:
        """Start a follower, or keep it a short way behind its session; with snapshots a session needs none.

        Args:
            step: step of the session.
            simulation: simulation of the session.
            actions: all actions of the session.
            presses: all inputs of its game.
            until: time (`perf_counter`, s) at which to stop.
            is_idle: whether no picture waits, so that a large scene may be started as well.
        """
        follower = self._follower
        if follower is not None and (follower.step > step or not follower.is_usable):
            self.discard_from(0)
        if self._follower is not None:
            if step - self._follower.step > self._follower.lag:
                self._follower.advance(step - self._follower.lag // 2, actions, presses, until)
            return
        may_start = is_idle or len(simulation.bodies) <= MAX_BODIES_IN_PLAY
        if step >= MIN_FOLLOWED and may_start and not self._can_copy(simulation):
            self._follower = _start_follower(self._start, actions, self._game)

    def _can_copy(self, simulation: SwitchableSimulation) -> bool:
        engine = simulation.engine
        if engine not in self._makes_snapshots:
            try:
                simulation.snapshot()
                self._makes_snapshots[engine] = True
            except SnapshotError:
                self._makes_snapshots[engine] = False
        return self._makes_snapshots[engine]

    def discard_from(self, step: int) -> None:
        """Discard the follower if it has reached a step: the session has changed from there on."""
        if self._follower is not None and self._follower.step >= step:
            self._follower.close()
            self._follower = None

    def take(self, step: int, keyframe: Keyframe | None) -> Follower | None:
        """Return the follower, and keep it no more, if it is the shortest exact way to a step; otherwise None.

        Args:
            step: the step.
            keyframe: the last checkpoint before it.
        """
        follower = self._follower
        if follower is None or not follower.is_usable or follower.step > step:
            return None
        is_near = step - follower.step <= 2 * follower.lag
        if keyframe is not None and keyframe.step > follower.step and (keyframe.is_exact or not is_near):
            return None
        self._follower = None
        return follower


def _start_follower(
    start: tuple[Scene, str, Settings | None], actions: Sequence[Action], game: GameSession | None
) -> Follower | None:
    """Return a new follower at time 0; None if its first actions fail."""
    try:
        follower = Follower(start, actions, game)
    except Refusal:  # memory or work would exceed a limit
        return None
    if follower.is_usable:
        return follower
    follower.close()
    return None
