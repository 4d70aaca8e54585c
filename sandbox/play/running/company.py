"""Company: all that runs beside a session and tells how far it can be trusted."""

from sandbox.action import Action, ActionError
from sandbox.engines.contract import Refusal
from sandbox.play.footage.film import Film
from sandbox.play.running.companions import Companion, Trust, apart, follows, ghost_of
from sandbox.play.running.history import History
from sandbox.play.running.session import Session
from sandbox.play.running.trails import Trails
from sandbox.play.running.watch import Watch
from sandbox.play.sight import Flash
from sandbox.scene.compile.contacts import contact_matrix
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
        self._seen = History()  # of the ghost
        self._given_up: tuple[str, ...] = ()
        self._watch: Watch | None = None
        self._missed: list[float] = []
        self.begin()

    def begin(self, anew: bool = False) -> None:
        """Watch the session's relay, which is another one now.

        Args:
            anew: begin the ghost and the twin anew, too, from where the session is. Else they wait where they are:
                the session has gone back, and may come there again.
        """
        session = self._session
        self._missed = [time for time in self._missed if time <= session.time]
        # What can meet nothing misses nothing.
        meets = not bool(contact_matrix(session.relay.setup, session.bodies).free.all())
        self._watch = Watch(session.relay) if meets else None
        self.trails.keep(session.frame)
        if self.trust is not None:
            self.trust.look(session.frame, session.step_number)
        session.redone()
        if anew:
            self._begin_companions()

    def _begin_companions(self) -> None:
        if self._ghost is not None:
            self._begin_ghost()
        if self.trust is not None:
            self.show_trust(True)

    def advance(self, redone: list[tuple[int, Action]]) -> None:
        """Go where the session has gone.

        Args:
            redone: what it has done again on the way, each with the step after which it was.
        """
        frame, step = self._session.frame, self._session.step_number
        self.trails.keep(frame)
        if self._watch is not None:
            self._missed += [frame.time] * self._watch.look(frame)
        for each in (self._ghost, self.trust):
            if each is None:
                continue
            been = each.step  # all that was done up to then it has done; after one step there may be several things
            for at, action in redone:
                if at > been:
                    each.follow(at)
                    self._let(each, action)
            each.follow(step)
        if self.trust is not None:
            self.trust.look(frame, step)
        if self._ghost is not None:
            if self._ghost.frame is not None:
                self._seen.keep(self._ghost.step, self._ghost.frame)
            else:
                self._replace_ghost(self._ghost)

    def did(self, action: Action) -> None:
        """Take note of something new that the session has done; where that is in the past, what came is no more."""
        step = self._session.step_number
        if self._ghost is not None and self._ghost.step > step:
            self._begin_ghost()
        elif self._ghost is not None:
            self._let(self._ghost, action)
        if self.trust is not None and (self.trust.step > step or self.trust.horizon is not None):
            self.show_trust(True)
        elif self.trust is not None:
            self._let(self.trust, action)
        self._session.redone()

    def _let(self, each: Companion | Trust, action: Action) -> None:
        """Let one do what the session has done; the ghost keeps its own engine."""
        followed = follows(action) if each is self._ghost else action
        if followed is not None:
            each.act(followed)

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
        self._film, self._given_up = None, ()
        self._drop_ghost()
        if on:
            self._begin_ghost()

    def _begin_ghost(self) -> None:
        """Begin a ghost from here, on the first engine that can and has not been given up."""
        self._drop_ghost()
        try:
            self._ghost, note = ghost_of(self._session.relay.checkpoint(), self._session.step_number, self._given_up)
        except ActionError as error:
            self.notes.append(("warning", f"no ghost: {error}"))
            return
        self._seen = History()
        if self._ghost.frame is not None:
            self._seen.keep(self._ghost.step, self._ghost.frame)
        if note:
            self.notes.append(("info", f"ghost computed by {self._ghost.engine}: {note}"))

    def _replace_ghost(self, ended: Companion) -> None:
        """Let another engine go on as the ghost, from here."""
        self._given_up += (ended.engine,)
        self.notes.append(("warning", f"ghost of {ended.engine} stopped: {ended.ended}"))
        self._begin_ghost()

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
                self.trust = Trust(self._session.relay.checkpoint(), self._session.step_number)
            except (Refusal, ActionError) as error:
                self.notes.append(("warning", f"no predictability horizon: {error}"))

    @property
    def ghost_frame(self) -> Frame | None:
        """The ghost's state."""
        if self._film is not None:
            return self._film.frame(self._session.time)
        time = self._session.time
        if self._ghost is None or time < self._ghost.begun - 1e-12:
            return None
        return self._ghost.frame if self._session.step_number == self._ghost.step else self._seen.nearest(time)[1]

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
