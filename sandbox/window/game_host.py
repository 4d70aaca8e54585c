"""Game host: connects the game of a session with the window: controls, display, and the history of the display.

Several keys and a gamepad may hold a control at the same time; its value is the largest of theirs.
"""

from bisect import bisect_right
from collections.abc import Mapping
from typing import NamedTuple

from sandbox.action import Action
from sandbox.game_spec import import_part
from sandbox.games.contract import Control, HasLamps, HasLog, HasWaiting, Rules
from sandbox.games.registry import spec_in_window
from sandbox.games.session import GameSession
from sandbox.scene.compile.scene import Scene
from sandbox.window.game_controls import GameControls
from sandbox.window.playback.live import LiveView

MAX_ENTRIES = 10_000
"""entries of a display history; when it is full, every second entry of the older half is dropped"""


class ScoreDisplay(NamedTuple):
    """Score, labelled values and result of a game."""

    score: str
    lines: tuple[tuple[str, str], ...]
    """(label, text) rows"""
    over: str | None
    """result; None during the game"""
    can_restart: bool = True
    """whether the key R starts a new game at present; not while it would be typed as an initial"""


class GameDisplay(NamedTuple):
    """Display of a game at a point in time."""

    board: ScoreDisplay
    lit: frozenset[str]
    """names of the parts whose lamps are lit"""


class DisplayHistory:
    """Displays of a game by time, since rules know only the present. Equal successive displays are stored once."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._shown: list[GameDisplay] = []

    def add(self, time: float, end: float, shown: GameDisplay) -> None:
        """Store the display at a time, s; entries after `end`, the end of the session, s, are dropped."""
        known = bisect_right(self._times, end)
        del self._times[known:], self._shown[known:]
        index = bisect_right(self._times, time)
        if index and self._shown[index - 1] == shown:
            return
        if index and self._times[index - 1] == time:
            self._shown[index - 1] = shown
            return
        self._times.insert(index, time)
        self._shown.insert(index, shown)
        if len(self._times) > MAX_ENTRIES:
            half = MAX_ENTRIES // 2
            self._times[:half], self._shown[:half] = self._times[:half:2], self._shown[:half:2]

    def at(self, time: float) -> GameDisplay | None:
        """Return the display at a time, s; before the first entry, the first one; None if empty."""
        return self._shown[max(bisect_right(self._times, time) - 1, 0)] if self._shown else None


def host_of(live: LiveView) -> "GameHost | None":
    """Return a host for the game of a session; None if it has no game."""
    return None if live.session.game is None else GameHost(live, live.session.game)


def controls_of(host: "GameHost", file: Scene, options: Mapping[str, str]) -> GameControls | None:
    """Return the controls of a game that has more than the keys of its rules; None for other games.

    Args:
        host: of the game.
        file: the scene as in its file.
        options: values of `GameControls.parameters` that were chosen.
    """
    spec = spec_in_window(host.live.scene)
    if spec is None or spec.window is None or spec.window.controls is None:
        return None
    controls: GameControls = import_part(spec.window.controls)(host, file, options)
    return controls


class GameHost:
    """Passes player input to the game of a session, and reads its display, messages and sounds."""

    def __init__(self, live: LiveView, game: GameSession) -> None:
        self.live = live
        self.controls: tuple[Control, ...] = game.rules.controls
        self.touched = False
        """whether the player has given input beyond that of a recording"""
        self._held: dict[str, dict[object, float]] = {control.name: {} for control in self.controls}
        self._game: GameSession | None = None  # game at the last call of `cues`
        self._warned = False
        self._read = 0  # number of log entries already returned
        self._history = DisplayHistory()

    @property
    def rules(self) -> Rules:
        """The present rules; a step back replaces them by a copy."""
        assert self.live.session.game is not None
        return self.live.session.game.rules

    def hold(self, source: object, control: str, value: float) -> None:
        """Set the value at which one source holds a control, and apply the largest value of all sources.

        Args:
            source: key code, or gamepad and button.
            control: name of the control.
            value: 0 (released) to 1.

        Raises:
            ActionError: a resulting action is refused.
        """
        sources = self._held[control]
        before = max(sources.values(), default=0.0)
        sources.pop(source, None)
        if value > 0.0:
            sources[source] = value
        now = max(sources.values(), default=0.0)
        if now != before:
            self.set_control(control, now)

    def apply(self, action: Action) -> None:
        """Apply an action of the player.

        Raises:
            ActionError: it is refused.
        """
        self.touched = True
        self.live.apply(action)

    def set_control(self, control: str, value: float) -> None:
        """Set a control to a value, 0 to 1.

        Raises:
            ActionError: a resulting action is refused.
        """
        self.touched = True
        game = self.live.session.game
        past = game is not None and bool(game.future_presses)
        self.live.apply_input(control, value)
        if past:  # releases in the discarded future are applied now, except for controls that are held
            for name in self._pressed():
                if not self._held[name] and name != control:
                    self.live.apply_input(name, 0.0)

    def _pressed(self) -> list[str]:
        """Return the names of the controls that are held according to the input log."""
        game = self.live.session.game
        last = {press.control: press.value for press in game.presses} if game is not None else {}
        return [name for name, value in last.items() if value > 0.0]

    @property
    def waiting(self) -> bool:
        """Whether time is held until the player acts."""
        return self.live.session.waiting

    @property
    def can_wait(self) -> bool:
        """Whether the rules hold time at all."""
        return isinstance(self.rules, HasWaiting)

    def messages(self, *, with_log: bool) -> list[tuple[str, str]]:
        """Return (level, text) of the messages since the last call; `with_log` includes the log of the game."""
        return [
            *(("warning", text) for text in self._divergence_notes()),
            *(("info", text) for text in self._log_notes() if with_log),
        ]

    def _divergence_notes(self) -> list[str]:
        """Return a warning, once, if the rules do not reproduce a recorded game."""
        game = self.live.session.game
        if self._warned or game is None or game.diverged_at is None:
            return []
        self._warned = True
        return [f"from {game.diverged_at:g} s on, the rules no longer reproduce the recording"]

    def _log_notes(self) -> list[str]:
        """Return the new entries of the game's log; after a step back, entries may repeat."""
        if not isinstance(self.rules, HasLog):
            return []
        log, known = self.rules.log, self._read
        self._read = len(log)
        return [text for _, text in log[known:]]

    def shown(self) -> GameDisplay:
        """Return the display of the game at the displayed time."""
        live, rules = self.live, self.rules
        then = self._history.at(live.frame.time) if live.is_previewing else None
        if then is not None:
            return then
        score = f"{rules.score:,}" if isinstance(rules.score, int) else f"{rules.score:,.1f}"
        board = ScoreDisplay(score, tuple(rules.display_lines()), rules.game_over)
        now = GameDisplay(board, rules.lit_lamps() if isinstance(rules, HasLamps) else frozenset())
        if not live.is_previewing:
            self._history.add(live.frame.time, live.end_time, now)
        return now

    def cues(self) -> tuple[str, ...]:
        """Return the names of cues since the last call; none during a seek or after a step back."""
        cues, game = tuple(self.rules.sounds()), self.live.session.game
        known, self._game = self._game is game, game
        return cues if known and self.live.busy is None else ()
