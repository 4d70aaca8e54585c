"""Lasting: what goes on acting on the bodies of a scene until it is taken back, and so has to be handed over."""

from collections.abc import Iterable, Mapping

from sandbox.action import Action, Force, Remove, Throttle


class Lasting:
    """Steady forces by the names of their bodies, throttles by those of their thrusts."""

    def __init__(
        self, forces: Mapping[str, Force] | None = None, throttles: Mapping[str, Throttle] | None = None
    ) -> None:
        self._forces, self._throttles = dict(forces or {}), dict(throttles or {})

    def note(self, action: Action) -> None:
        """Take note of an action that was done."""
        if isinstance(action, Force):
            self._forces[action.body] = action
        elif isinstance(action, Throttle):
            self._throttles[action.thrust] = action
        elif isinstance(action, Remove):
            self._forces.pop(action.body, None)

    def leave(self, gone: Iterable[str]) -> None:
        """Let the forces end that act on who is no longer there."""
        for name in gone:
            self._forces.pop(name, None)

    @property
    def forces(self) -> dict[str, Force]:
        """The force on each body."""
        return dict(self._forces)

    @property
    def throttles(self) -> dict[str, Throttle]:
        """The throttle of each thrust."""
        return dict(self._throttles)

    def actions(self) -> list[Force | Throttle]:
        """Return what brings all of it about in another simulation."""
        return [*self._forces.values(), *self._throttles.values()]
