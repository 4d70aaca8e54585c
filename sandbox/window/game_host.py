"""Host: a game with rules in the window: what hands hold down, what is shown of it; no pygame.

A control may be held by several keys and a gamepad at once; it is let go with the last of them.

Past: what a game showed at earlier times, for who looks back: its rules know the present alone.
"""

from bisect import bisect_right
from typing import NamedTuple

from sandbox.games.contract import Control, HasLamps, HasLog, Rules, UnsuitableSceneError
from sandbox.games.registry import rules_of
from sandbox.games.session import GameSession
from sandbox.scene.scene import Scene
from sandbox.window.messages import Messages
from sandbox.window.playback.live import LiveView

MAX_ENTRIES = 10_000
"""moments that are kept; of what was long ago, where there are more, every second"""


class ScoreDisplay(NamedTuple):
    """What is shown of a game."""

    score: str
    lines: tuple[tuple[str, str], ...]
    """labels and texts"""
    over: str | None
    """why it is over; None while it goes on"""


class GameDisplay(NamedTuple):
    """A moment of a game, as it is seen."""

    board: ScoreDisplay
    lit: frozenset[str]
    """names of the parts whose lamps are lit"""


class DisplayHistory:
    """What was shown, by its time; a moment that shows what the one before did is not kept."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._shown: list[GameDisplay] = []

    def note(self, time: float, end: float, shown: GameDisplay) -> None:
        """Take note of what is shown at a time, s; what was beyond the end, s, of all that has been is forgotten."""
        known = bisect_right(self._times, end)
        del self._times[known:], self._shown[known:]
        place = bisect_right(self._times, time)
        if place and self._shown[place - 1] == shown:
            return
        if place and self._times[place - 1] == time:
            self._shown[place - 1] = shown
            return
        self._times.insert(place, time)
        self._shown.insert(place, shown)
        if len(self._times) > MAX_ENTRIES:
            half = MAX_ENTRIES // 2
            self._times[:half], self._shown[:half] = self._times[:half:2], self._shown[:half:2]

    def at(self, time: float) -> GameDisplay | None:
        """Return what was shown at a time, s, or first of all; None if nothing was yet."""
        return self._shown[max(bisect_right(self._times, time) - 1, 0)] if self._shown else None


def game_session_of(scene: Scene, messages: Messages) -> GameSession | None:
    """Begin the game of a scene; one that cannot be played is told, and the scene goes on without."""
    try:
        rules = rules_of(scene)
    except UnsuitableSceneError as error:
        messages.tell(str(error), "warning")
        return None
    return None if rules is None else GameSession(rules)


def host_of(live: LiveView) -> "GameHost | None":
    """Return who hosts the game of a session; none where it has none."""
    return None if live.session.game is None else GameHost(live, live.session.game)


class GameHost:
    """Lets hands play the game of a session."""

    def __init__(self, live: LiveView, game: GameSession) -> None:
        self.live = live
        self.controls: tuple[Control, ...] = game.rules.controls
        self.touched = False
        """whether hands have played, and not a recording alone"""
        self._held: dict[str, dict[object, float]] = {control.name: {} for control in self.controls}
        self._game: GameSession | None = None  # whose cues were heard last
        self._told = False
        self._read = 0  # entries of the game's log
        self._past = DisplayHistory()

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
        past = game is not None and bool(game.future_presses)
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
        if self._told or game is None or game.diverged_at is None:
            return []
        self._told = True
        return [f"from {game.diverged_at:g} s on, the rules no longer reproduce the recording"]

    def _news(self) -> list[str]:
        """Return what a game with a log has told since the last call; of what is taken back it may tell again."""
        if not isinstance(self.rules, HasLog):
            return []
        log, known = self.rules.log, self._read
        self._read = len(log)
        return [text for _, text in log[known:]]

    def shown(self) -> GameDisplay:
        """Return what is seen of the game, as it was at the time that is looked at."""
        live, rules = self.live, self.rules
        then = self._past.at(live.frame.time) if live.peeking else None
        if then is not None:
            return then
        score = f"{rules.score:,}" if isinstance(rules.score, int) else f"{rules.score:,.1f}"
        board = ScoreDisplay(score, tuple(rules.display_lines()), rules.game_over)
        now = GameDisplay(board, rules.lit_lamps() if isinstance(rules, HasLamps) else frozenset())
        if not live.peeking:
            self._past.note(live.frame.time, live.end, now)
        return now

    def cues(self) -> tuple[str, ...]:
        """Return the sounds of what happened since the last call; what is seen again on a way back is not heard."""
        cues, game = tuple(self.rules.sounds()), self.live.session.game
        known, self._game = self._game is game, game
        return cues if known and self.live.busy is None else ()
