"""Log of the actions of a session, with the number already applied, and the history of scene changes they cause."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence

from sandbox.action import Action, Pull, Reshape, Switch, Toggle
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene

TIME_ROUNDING = 1e-9
"""Tolerance of due times as a fraction of a step: sums of dt have rounding errors."""


class ActionLog:
    """Actions of a session in order of time. After a seek backwards, those in the future are replayed."""

    def __init__(self, actions: tuple[Action, ...] = ()) -> None:
        self._actions = list(actions)
        self.done = 0
        """number of applied actions"""
        self.saved: tuple[Action, ...] = ()
        """all actions at the last save"""

    @property
    def past(self) -> tuple[Action, ...]:
        """The actions up to the present."""
        return tuple(self._actions[: self.done])

    @property
    def all(self) -> tuple[Action, ...]:
        """All actions, including those in the future."""
        return tuple(self._actions)

    @property
    def unsaved(self) -> tuple[Action, ...]:
        """The actions since the last save, also those in the future."""
        saved, done = (
            [action for action in actions if not _only_restores(action)] for actions in (self.saved, self._actions)
        )
        return tuple(done[len(saved) :] if done[: len(saved)] == saved else done)

    @property
    def has_future(self) -> bool:
        """Whether there are actions in the future."""
        return self.done < len(self._actions)

    def truncate(self, index: int) -> None:
        """Discard the actions from an index on."""
        del self._actions[index:]
        self.done = min(self.done, index)

    def due(self, simulation: SwitchableSimulation) -> Sequence[Action]:
        """Return the actions up to the present time that are not applied yet."""
        return due_actions(simulation, self._actions, self.done)

    def replay_due(self, simulation: SwitchableSimulation) -> Sequence[Action]:
        """Apply the due actions and return them.

        Raises:
            ActionError: the engine refuses an action, which can happen with a recording of another engine.
        """
        due = self.due(simulation)
        for action in due:
            simulation.apply(action)
            self.done += 1
        return due

    def append(self, action: Action) -> None:
        """Log an action that was just applied; there must be no future actions."""
        self._actions.append(action)
        self.done = len(self._actions)

    def branch(self, actions: Sequence[Action], simulation: SwitchableSimulation) -> None:
        """Discard the future actions, and log actions that were just applied.

        Pulls whose release was in the discarded future are released now, unless one of the actions pulls the same body.
        """
        future, self._actions[self.done :] = self._actions[self.done :], []
        pulled = {action.body for action in actions if isinstance(action, Pull)}
        for each in future:
            if isinstance(each, Pull) and each.target is None and each.body not in pulled:
                release = each.model_copy(update={"time": simulation.time})
                simulation.apply(release)
                self._actions.append(release)
        self._actions += actions
        self.done = len(self._actions)

    def insert_switch(self, index: int, time: float) -> bool:
        """Log the restoring of a checkpoint; return False if it is already logged.

        Args:
            index: number of actions applied before the checkpoint.
            time: of the checkpoint, s.
        """
        before = len(self._actions)
        self._actions = [*insert_switch(tuple(self._actions), index, time)]
        self.done += len(self._actions) - before
        return len(self._actions) > before


def due_actions(simulation: SwitchableSimulation, actions: Sequence[Action], done: int) -> Sequence[Action]:
    """Return the actions up to the present time after the first `done` ones."""
    latest, end = simulation.time + TIME_ROUNDING * simulation.settings.dt, done
    while end < len(actions) and actions[end].time <= latest:
        end += 1
    return actions[done:end]


def insert_switch(actions: tuple[Action, ...], index: int, time: float) -> tuple[Action, ...]:
    """Return actions with the restoring of a checkpoint inserted at an index, unless it is already there; time in s."""
    switch = Switch(time=time, resumes=True)
    return actions if actions[:index][-1:] == (switch,) else (*actions[:index], switch, *actions[index:])


def _only_restores(action: Action) -> bool:
    """Return whether an action restores a checkpoint, which changes nothing."""
    return isinstance(action, Switch) and action.engine is None and not action.settings


class SceneHistory:
    """Scene of a run at any time, as changed by actions. Equal times return the same object."""

    def __init__(self, scene: Scene, actions: Iterable[Action]) -> None:
        """Compute the scene after each action that changes it.

        Args:
            scene: initial scene.
            actions: in order of time.
        """
        self._times: list[float] = []
        self._scenes = [scene]
        for action in actions:
            if isinstance(action, Reshape | Toggle):
                self._times.append(action.time)
                self._scenes.append(_changed(self._scenes[-1], action))

    def at(self, time: float) -> Scene:
        """Return the scene at a time, s."""
        return self._scenes[bisect_right(self._times, time)]


def _changed(scene: Scene, action: Reshape | Toggle) -> Scene:
    """Return a scene with the change that an action makes to its walls and posts."""
    change = {"points": action.points} if isinstance(action, Reshape) else {"solid": action.solid}
    names = dict(zip((id(each) for each in scene.fixed), scene.fixed_names, strict=False))  # pockets last
    walls, posts = (
        tuple(each.model_copy(update=change) if names[id(each)] == action.thing else each for each in fixed)
        for fixed in (scene.walls, scene.posts)
    )
    return scene.model_copy(update={"walls": walls, "posts": posts})
