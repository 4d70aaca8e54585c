"""Scenery: a run's scene at any time, with the walls that were given another course and what was made solid or not."""

from bisect import bisect_right
from collections.abc import Iterable

from sandbox.action import Action, Reshape, Toggle
from sandbox.scene.scene import Scene


class Scenery:
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
