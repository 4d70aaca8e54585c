"""Panel: the lines of the score panel."""

from collections.abc import Sequence

from sandbox.games.pinball.modes import Modes
from sandbox.games.pinball.sheet import BALLS, Sheet

Line = tuple[str, str]


def panel(sheets: Sequence[Sheet], turn: int, modes: Modes, saved: float, message: str) -> list[Line]:
    """Return labels and texts, the most important first, without the score: whoever shows them has that.

    Args:
        sheets: of the players.
        turn: who plays, from 0.
        modes: what runs.
        saved: s, in which drained balls come back; 0 or less for none.
        message: the last news; empty for none.
    """
    sheet = sheets[turn]
    ball = f"{min(sheet.ball, BALLS)} of {BALLS}"
    lines = [("Ball", f"{ball}, shoot again" if sheet.again else ball)]
    if len(sheets) > 1:
        lines.insert(0, ("Player", f"{turn + 1} of {len(sheets)}"))
        lines += [(f"Player {k + 1}", f"{each.score:,}") for k, each in enumerate(sheets) if k != turn]
    lines.append(("Bonus", f"{sheet.bonus:,} × {sheet.times}"))
    if sheet.locked or sheet.lit:
        lit = ["lock is lit"] if sheet.lit else []
        lines.append(("Locked", ", ".join([str(sheet.locked), *lit])))
    if modes.mode is not None:
        lines.append((modes.mode.name.capitalize(), f"{modes.to_go} to go, {modes.left:.0f} s"))
    elif modes.ready:
        lines.append(("Mode", "ready"))
    if saved > 0.0:
        lines.append(("Ball save", f"{saved:.0f} s"))
    if message:
        lines.append(("", message))
    return lines
