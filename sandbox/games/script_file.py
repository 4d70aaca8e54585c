"""Script files: who presses what when, a line each: `time, control, value`; what follows a # is a remark."""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from sandbox.echo import short_repr, shorten
from sandbox.games.rules import Control, Press
from sandbox.scene.errors import Fault, SceneError
from sandbox.whole import read_whole

LONGEST = 1e9
"""s, as of a scene"""

MAX_BYTES = 16 * 2**20

MAX_FAULTS = 20
"""Faults that are reported; of a file that is no script, every line is wrong."""


def read_script(path: str | Path) -> tuple[Press, ...]:
    """Read a script.

    Raises:
        SceneError: it cannot be read, or lines are wrong; all of them are told.
    """
    try:
        lines = read_whole(Path(path), MAX_BYTES).decode("utf-8").splitlines()
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault(str(path), None, "", f"cannot be read: {reason}")]) from None
    presses, faults = [], []
    for number, text in _said(lines):
        try:
            presses.append(_press(text))
        except ValueError as error:
            faults.append(Fault(str(path), number, "", str(error)))
    if faults:
        raise SceneError(_some(faults, str(path)))
    return tuple(sorted(presses, key=lambda press: press.time))


def _said(lines: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines that say something, without remarks, and their numbers from 1 on."""
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if text:
            yield number, text


def _press(text: str) -> Press:
    parts = [part.strip() for part in text.split(",")]
    try:
        time, control, value = float(parts[0]), ",".join(parts[1:-1]).strip(), float(parts[-1])
    except ValueError:
        raise ValueError(f"{short_repr(text)} should be `time, control, value`, such as `0.5, left, 1`") from None
    if len(parts) < 3 or not control:
        raise ValueError(f"{short_repr(text)} should be `time, control, value`, such as `0.5, left, 1`")
    if not (0.0 <= time <= LONGEST):
        raise ValueError(f"a time of {shorten(parts[0])} s is out of range; it should be 0 to {LONGEST:g}")
    if not (math.isfinite(value) and 0.0 <= value <= 1.0):
        raise ValueError(f"a value of {shorten(parts[-1])} is out of range; it should be 0 to 1, 0 releases it")
    return Press(time, control, value)


def faults_of(presses: Sequence[Press], controls: Sequence[Control], file: str) -> list[Fault]:
    """Return what of a script a game cannot do, each fault once, with the line where it is first."""
    known = {control.name: control for control in controls}
    names = ", ".join(map(repr, known))
    found: dict[str, Press] = {}
    for press in presses:
        if press.control not in known:
            found.setdefault(f"there is no control {short_repr(press.control)}; the game has {names}", press)
        elif not known[press.control].analogue and press.value not in (0.0, 1.0):
            found.setdefault(f"{short_repr(press.control)} is 0 or 1, not {press.value:g}", press)
    lines = _lines(file) if found else {}
    faults = [Fault(file, lines.get(press), "", message) for message, press in found.items()]
    return _some(faults, file)


def _some(faults: list[Fault], file: str) -> list[Fault]:
    """Return the first `MAX_FAULTS` faults, and one that stands for the others."""
    more = len(faults) - MAX_FAULTS
    if more <= 0:
        return faults
    return [*faults[:MAX_FAULTS], Fault(file, None, "", f"{more:,} more faults")]


def _lines(file: str) -> dict[Press, int]:
    """Return the line of each press; none where the file has gone since it was read."""
    try:
        said = [*_said(read_whole(Path(file), MAX_BYTES).decode("utf-8").splitlines())]
        return {_press(text): number for number, text in reversed(said)}  # of equals the first
    except (OSError, ValueError):
        return {}
