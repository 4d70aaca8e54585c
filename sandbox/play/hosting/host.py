"""Host: a game with rules in the window: what hands hold down, what is shown of it; no pygame.

A control may be held by several keys and a gamepad at once; it is let go with the last of them.
"""

from sandbox.games.referee import Referee
from sandbox.games.registry import rules_of
from sandbox.games.rules import Control, Lit, Logged, Rules, UnfitError
from sandbox.play.hosting.past import Board, Past, Shown
from sandbox.play.messages import Messages
from sandbox.play.running.live import Live
from sandbox.scene.scene import Scene


def refereed(scene: Scene, messages: Messages) -> Referee | None:
    """Begin the game of a scene; one that cannot be played is told, and the scene goes on without."""
    try:
        rules = rules_of(scene)
    except UnfitError as error:
        messages.tell(str(error), "warning")
        return None
    return None if rules is None else Referee(rules)


def hosted(live: Live) -> "Host | None":
    """Return who hosts the game of a session; none where it has none."""
    return None if live.session.game is None else Host(live, live.session.game)


class Host:
    """Lets hands play the game of a session."""

    def __init__(self, live: Live, game: Referee) -> None:
        self.live = live
        self.controls: tuple[Control, ...] = game.rules.controls
        self.touched = False
        """whether hands have played, and not a recording alone"""
        self._held: dict[str, dict[object, float]] = {control.name: {} for control in self.controls}
        self._game: Referee | None = None  # whose cues were heard last
        self._told = False
        self._read = 0  # entries of the game's log
        self._past = Past()

    @property
    def rules(self) -> Rules:
        """The game as it stands; going back brings another."""
        assert self.live.session.game is not None
        return self.live.session.game.rules

    def hold(self, source: object, control: str, value: float) -> None:
        """Take note of how far a key or a button holds a control, 0 lets it go, and set the control by all of them.

        Args:
            source: which key or button.
            control: its name.
            value: 0 to 1.

        Raises:
            ActionError: what comes of it cannot be done now.
        """
        sources = self._held[control]
        before = max(sources.values(), default=0.0)
        sources.pop(source, None)
        if value > 0.0:
            sources[source] = value
        now = max(sources.values(), default=0.0)
        if now != before:
            self.touched = True
            self._press(control, now)

    def _press(self, control: str, value: float) -> None:
        game = self.live.session.game
        past = game is not None and bool(game.coming)
        self.live.press(control, value)
        if past:  # what was to be let go of later is forgotten, so it is let go of now, unless a hand holds it
            for name in self._pressed():
                if not self._held[name] and name != control:
                    self.live.press(name, 0.0)

    def _pressed(self) -> list[str]:
        """Return the controls that are down, by what was pressed up to now."""
        game = self.live.session.game
        last = {press.control: press.value for press in game.presses} if game is not None else {}
        return [name for name, value in last.items() if value > 0.0]

    def notes(self) -> list[tuple[str, str]]:
        """Return (level, text) of what is to be said since the last call."""
        return [*(("warning", text) for text in self._doubts()), *(("info", text) for text in self._news())]

    def _doubts(self) -> list[str]:
        """Return what is to be said, once, where a recorded game goes otherwise than the rules would have it."""
        game = self.live.session.game
        if self._told or game is None or game.otherwise is None:
            return []
        self._told = True
        return [f"from {game.otherwise:g} s on, the rules no longer reproduce the recording"]

    def _news(self) -> list[str]:
        """Return what a game with a log has told since the last call; of what is taken back it may tell again."""
        if not isinstance(self.rules, Logged):
            return []
        log, known = self.rules.log, self._read
        self._read = len(log)
        return [text for _, text in log[known:]]

    def shown(self) -> Shown:
        """Return what is seen of the game, as it was at the time that is looked at."""
        live, rules = self.live, self.rules
        then = self._past.at(live.frame.time) if live.peeking else None
        if then is not None:
            return then
        score = f"{rules.score:,}" if isinstance(rules.score, int) else f"{rules.score:,.1f}"
        board = Board(score.replace(",", " "), tuple(rules.lines()), rules.over)
        now = Shown(board, rules.lit() if isinstance(rules, Lit) else frozenset())
        if not live.peeking:
            self._past.note(live.frame.time, live.end, now)
        return now

    def cues(self) -> tuple[str, ...]:
        """Return the sounds of what happened since the last call; what is seen again on a way back is not heard."""
        cues, game = tuple(self.rules.cues()), self.live.session.game
        known, self._game = self._game is game, game
        return cues if known and self.live.busy is None else ()
