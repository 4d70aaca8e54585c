"""Script: all that is done in a session, in order, and how far it has been done.

Scenery: a run's scene at any time, with the walls that were given another course and what was made solid or not.
"""

from bisect import bisect_right
from collections.abc import Iterable

from sandbox.action import Action, Pull, Reshape, Switch, Toggle
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.scene import Scene

ROUNDING = 1e-9
"""Shares of a step by which an action may be late."""


class ActionLog:
    """The actions of a session. What lies ahead was done before the session went back, and is done again."""

    def __init__(self, actions: tuple[Action, ...] = ()) -> None:
        self._actions = list(actions)
        self.done = 0
        """how many have been done"""

    @property
    def so_far(self) -> tuple[Action, ...]:
        """What was done up to now."""
        return tuple(self._actions[: self.done])

    @property
    def whole(self) -> tuple[Action, ...]:
        """What was done, also later than now."""
        return tuple(self._actions)

    @property
    def ahead(self) -> bool:
        """Whether more was done than up to now."""
        return self.done < len(self._actions)

    def cut(self, place: int) -> None:
        """Forget the actions from a place in the order on."""
        del self._actions[place:]
        self.done = min(self.done, place)

    def due(self, relay: SwitchableSimulation) -> list[Action]:
        """Return what was done at this time, and has not yet been done again."""
        due = relay.time + ROUNDING * relay.settings.dt
        end = self.done
        while end < len(self._actions) and self._actions[end].time <= due:
            end += 1
        return self._actions[self.done : end]

    def redo(self, relay: SwitchableSimulation) -> list[Action]:
        """Do what was done at this time, and return it.

        Raises:
            ActionError: the engine cannot do it, as may be with a recording of another.
        """
        due = self.due(relay)
        for action in due:
            relay.apply(action)
            self.done += 1
        return due

    def add(self, action: Action | None, relay: SwitchableSimulation) -> None:
        """Take note of what has just been done, if anything; what lay ahead is forgotten.

        Who was to be let go of later is let go of now, unless the action says more of it.
        """
        ahead, self._actions[self.done :] = self._actions[self.done :], []
        for each in ahead:
            goes_on = isinstance(action, Pull) and isinstance(each, Pull) and action.body == each.body
            if isinstance(each, Pull) and each.target is None and not goes_on:
                release = each.model_copy(update={"time": relay.time})
                relay.apply(release)
                self._actions.append(release)
        if action is not None:
            self._actions.append(action)
        self.done = len(self._actions)

    def hand_over(self, place: int, time: float) -> bool:
        """Make it part of the session that it was taken up at a checkpoint; return whether it was not yet.

        Args:
            place: how many actions had been done there.
            time: when that was, s.
        """
        known = len(self._actions)
        self._actions = [*switch_actions(tuple(self._actions), place, time)]
        self.done += len(self._actions) - known
        return len(self._actions) > known


def switch_actions(actions: tuple[Action, ...], place: int, time: float) -> tuple[Action, ...]:
    """Return actions with the taking up of a checkpoint at a place and a time, s, where it is not there yet."""
    switch = Switch(time=time, resumes=True)
    return actions if actions[:place][-1:] == (switch,) else (*actions[:place], switch, *actions[place:])


class SceneHistory:
    """The scenes that a run has been through. Each is one and the same object whenever it is asked for."""

    def __init__(self, scene: Scene, actions: Iterable[Action]) -> None:
        """Take a scene as it began, and what was done, in order of time."""
        self._times: list[float] = []
        self._scenes = [scene]
        for action in actions:
            if isinstance(action, Reshape | Toggle):
                self._times.append(action.time)
                self._scenes.append(_changed(self._scenes[-1], action))

    def at(self, time: float) -> Scene:
        """Return the scene of a time, s."""
        return self._scenes[bisect_right(self._times, time)]


def _changed(scene: Scene, action: Reshape | Toggle) -> Scene:
    """Return a scene with what an action changes of its walls and posts."""
    change = {"points": action.points} if isinstance(action, Reshape) else {"solid": action.solid}
    names = dict(zip((id(thing) for thing in scene.fixed), scene.fixed_names, strict=False))  # pockets come last
    walls, posts = (
        tuple(each.model_copy(update=change) if names[id(each)] == action.thing else each for each in those)
        for those in (scene.walls, scene.posts)
    )
    return scene.model_copy(update={"walls": walls, "posts": posts})
