"""Company: all that runs beside a session and tells how far it can be trusted."""

from sandbox.action import Action, ActionError
from sandbox.engines.contract import Refusal
from sandbox.play.footage.film import Film
from sandbox.play.running.companions import Companion, Trust, apart, follows, ghost_of
from sandbox.play.running.session import Session
from sandbox.play.running.trails import Trails
from sandbox.play.running.watch import Watch
from sandbox.play.sight import Flash
from sandbox.scene.meetings import meetings
from sandbox.trajectory import Frame


class Company:
    """The ghost, the twin, the audit and the trails of a session.

    All of them begin from where the session is, and anew whenever it has gone back or changed its engine.
    """

    def __init__(self, session: Session, film: Film | None = None) -> None:
        """Begin.

        Args:
            session: what is played.
            film: a stored run to be seen as the ghost, instead of another engine.
        """
        self._session, self._film = session, film
        self.trails = Trails()
        self.notes: list[tuple[str, str]] = []
        """(level, text) of what happened; whoever tells it empties the list"""
        self.trust: Trust | None = None
        """the twin that is being watched"""
        self._ghost: Companion | None = None
        self._watch: Watch | None = None
        self._missed: list[float] = []
        self.begin()

    def begin(self) -> None:
        """Begin anew from where the session is."""
        session = self._session
        self._missed = [time for time in self._missed if time <= session.time]
        # What can meet nothing misses nothing.
        meets = not bool(meetings(session.scene, session.bodies).free.all())
        self._watch = Watch(session.relay) if meets else None
        self.trails.keep(session.frame)
        if self._ghost is not None:
            self.show_ghost(True)
        if self.trust is not None:
            self.show_trust(True)

    def advance(self, steps: int) -> None:
        """Make as many steps as the session has made."""
        frame = self._session.frame
        self.trails.keep(frame)
        if self._watch is not None:
            self._missed += [frame.time] * self._watch.look(frame)
        if self.trust is not None:
            self.trust.advance(steps, frame)
        if self._ghost is not None:
            self._ghost.advance(steps)
            if self._ghost.ended is not None:
                self.notes.append(("warning", f"the ghost is gone: {self._ghost.ended}"))
                self._drop_ghost()

    def act(self, action: Action) -> None:
        """Do what the session has done."""
        followed = follows(action)
        if self._ghost is not None and followed is not None:
            self._ghost.act(followed)
        if self.trust is not None:
            self.trust.act(action)

    @property
    def missed(self) -> int | None:
        """Contacts missed so far; None where none can be."""
        return len(self._missed) if self._watch is not None else None

    @property
    def flashes(self) -> tuple[Flash, ...]:
        """The misses of a moment ago."""
        return self._watch.flashes() if self._watch is not None else ()

    @property
    def ghosted(self) -> bool:
        """Whether there is a ghost."""
        return self._ghost is not None or self._film is not None

    def show_ghost(self, on: bool) -> None:
        """Begin a ghost from here, or end it."""
        self._film = None
        self._drop_ghost()
        if on:
            try:
                self._ghost, note = ghost_of(self._session.relay.checkpoint())
            except ActionError as error:
                self.notes.append(("warning", f"no ghost: {error}"))
                return
            if note:
                self.notes.append(("info", f"the ghost is {self._ghost.engine}: {note}"))

    def _drop_ghost(self) -> None:
        if self._ghost is not None:
            self._ghost.close()
            self._ghost = None

    def show_trust(self, on: bool) -> None:
        """Begin to watch a twin from here, or end it."""
        if self.trust is not None:
            self.trust.close()
            self.trust = None
        if on:
            try:
                self.trust = Trust(self._session.relay.checkpoint())
            except (Refusal, ActionError) as error:
                self.notes.append(("warning", f"no trust light: {error}"))

    @property
    def ghost_frame(self) -> Frame | None:
        """The ghost's state."""
        if self._film is not None:
            return self._film.frame(self._session.time)
        return self._ghost.frame if self._ghost is not None else None

    @property
    def ghost_engine(self) -> str | None:
        """What computes the ghost."""
        if self._film is not None:
            return f"stored run ({self._film.trajectory.info['engine']})"
        return self._ghost.engine if self._ghost is not None else None

    @property
    def distance(self) -> float | None:
        """How far the ghost is away at most, m."""
        ghost = self.ghost_frame
        return None if ghost is None else apart(self._session.frame, ghost)

    def close(self) -> None:
        """Release all engines."""
        self._drop_ghost()
        self.show_trust(False)
