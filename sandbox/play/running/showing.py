"""Showing: a session as it is looked at: its present state, or another one that was seen."""

from sandbox.engines.common.energy_balance import energy_of
from sandbox.play.footage.scenery import Scenery
from sandbox.play.running.session import Session
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame


class Showing:
    """What is shown of a session. Looking at another state does not move the session."""

    def __init__(self, session: Session) -> None:
        """Show the present state."""
        self.session = session
        self._peek: tuple[int, Frame] | None = None  # number and state of another step than the present one
        self._scenery: Scenery | None = None  # as long as that is looked at

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self.session.scene

    @property
    def shown(self) -> Scene:
        """The scene of the state that is shown: with its walls as they were then."""
        if self._peek is None:
            self._scenery = None
            return self.scene
        self._scenery = self._scenery or self.session.scenery()
        return self._scenery.at(self._peek[1].time)

    @property
    def peeking(self) -> bool:
        """Whether another state than the present one is shown."""
        return self._peek is not None

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; of the state that is shown."""
        return self.session.bodies if self._peek is None else self.session.bodies_in(self._peek[1])

    @property
    def engine(self) -> str:
        """The present engine's name."""
        return self.session.engine

    @property
    def settings(self) -> Settings:
        """The present settings, with every choice filled in."""
        return self.session.settings

    @property
    def step_number(self) -> int:
        """Steps made since the start; of the state that is shown."""
        return self.session.step_number if self._peek is None else self._peek[0]

    @property
    def frame(self) -> Frame:
        """The state that is shown, or that the picture is just short of."""
        return self.session.frame if self._peek is None else self._peek[1]

    def scrub(self, time: float) -> None:
        """Look at the state seen nearest to a time, s; the session stays where it is until `settle`."""
        self._peek = self.session.history.nearest(time)

    @property
    def begin(self) -> float:
        """The first time that can be gone to, s."""
        return 0.0

    @property
    def end(self) -> float:
        """The last time that was seen, s."""
        return self.session.history.end

    @property
    def marks(self) -> tuple[float, ...]:
        """Times of the checkpoints, s."""
        return self.session.history.mark_times

    def energy(self) -> tuple[float, float, float]:
        """Return the kinetic, potential and total energy, J."""
        return energy_of(
            self.frame, self.bodies, self.scene.world.gravity, self.session.relay.setup, self.session.breaks
        )
