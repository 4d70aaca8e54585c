"""Needs: what a table must have for a game."""

from typing import Any

from sandbox.games.billiards.layout import Layout
from sandbox.games.billiards.rules.happening import GameError
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.state import State

SPOTS = {"8-ball": ("head", "foot"), "9-ball": ("head", "foot"), "carom": ("head", "centre", "foot")}
"""What a table needs for a rack; for snooker, the colours' own."""

COLOURS = ("yellow", "green", "brown", "blue", "pink", "black")


def require(layout: Layout, rules: Rules[Any], state: State) -> None:
    """Refuse a table on which a game cannot be played.

    Raises:
        GameError: with all that is wrong.
    """
    wanted = {*state.table, *(rules.cue_balls if rules.name != "free" else (rules.cue_ball(state),))}
    missing, idle = sorted(wanted - set(layout.names)), sorted(set(layout.names) - wanted)
    spots = [name for name in SPOTS.get(rules.rack, COLOURS) if name not in layout.spots and rules.name != "free"]
    wrong = [
        *([f"no ball {', '.join(missing)}"] if missing else []),
        *([f"the game does not use {', '.join(idle)}"] if idle else []),
        *([f"no spot {', '.join(spots)}; state a [[play.spot]]"] if spots else []),
        *(["it is no billiard table, as it has no [surface]"] if layout.scene.surface is None else []),
        *(["no pockets"] if not layout.pockets and rules.name in ("8-ball", "9-ball", "snooker") else []),
        *(["carom has no pockets"] if layout.pockets and rules.rack == "carom" else []),
    ]
    if wrong:
        raise GameError(f"{rules.name} cannot be played on this table: {'; '.join(wrong)}")
