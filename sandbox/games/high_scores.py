"""High scores: the ten best of each game and table, in one small file of the user's."""

import json
import os
import re
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, StringConstraints, TypeAdapter, ValidationError

from sandbox.scene.files.nesting import NestingError, check_text
from sandbox.scene.scene import Scene
from sandbox.whole import read_whole, whole

FOLDER = "SANDBOX_DATA"
"""An environment variable: the folder to keep the file in, where the platform's is not wanted."""

FILE = "high-scores.json"

BEST = 10
"""kept of each table"""

MAX_SCORE = 10**15
"""A score beyond this is damage: no game gives it, and it would not fit on a line."""

MAX_BYTES = 2**24
"""of the file; the ten best of a table take a few hundred"""

LETTERS = 3
"""of initials"""

_ENTRIES: TypeAdapter[dict[str, list[tuple[str, int | float]]]] = TypeAdapter(
    dict[
        str,
        list[
            tuple[
                Annotated[str, StringConstraints(pattern=r"^[A-Z0-9 .\-]{1,3}$")],
                Annotated[int, Field(ge=-MAX_SCORE, le=MAX_SCORE)]
                | Annotated[float, Field(ge=-MAX_SCORE, le=MAX_SCORE)],
            ]
        ],
    ]
)


@dataclass(frozen=True)
class Entry:
    """Who scored what."""

    initials: str
    score: int | float


@dataclass(frozen=True)
class HighScores:
    """The file, and what was wrong with it."""

    path: Path
    told: str | None = None
    """for the user: the file was damaged, and where it was put aside; None where it was in order"""

    def of(self, table: str) -> tuple[Entry, ...]:
        """Return the best of a table, the highest first.

        Raises:
            OSError: the file cannot be read.
            ValueError: it is damaged.
        """
        return tuple(Entry(*row) for row in self._read().get(table, [])[:BEST])

    def rank(self, table: str, score: int | float) -> int | None:
        """Return the place that a score would take, from 1; None where it takes none. Equals stay ahead of it.

        Raises:
            OSError: the file cannot be read.
            ValueError: it is damaged.
        """
        ahead = sum(each.score >= score for each in self.of(table))
        return ahead + 1 if score > 0 and ahead < BEST else None

    def enter(self, table: str, initials: str, score: int | float) -> int | None:
        """Enter a score, and return the place that it took; None where it took none, and nothing changed.

        Raises:
            OSError: the file cannot be read or written.
            ValueError: the file is damaged.
        """
        place = self.rank(table, score)
        if place is None:
            return None
        tables = self._read()
        rows = tables.setdefault(table, [])
        rows.insert(place - 1, (initials_of(initials), score))
        del rows[BEST:]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with whole(self.path) as temporary:
            temporary.write_text(json.dumps(tables, indent=1, ensure_ascii=False, sort_keys=True), encoding="utf-8")
        return place

    def _read(self) -> dict[str, list[tuple[str, int | float]]]:
        try:
            text = read_whole(self.path, MAX_BYTES).decode("utf-8")
        except FileNotFoundError:
            return {}
        try:
            check_text(text)
            return _ENTRIES.validate_python(_as_rows(json.loads(text)))
        except (ValidationError, NestingError) as error:
            raise ValueError(f"{self.path} is not a high-score file: {str(error).splitlines()[0]}") from None


def opened(path: Path | None = None) -> HighScores:
    """Return the high scores. A damaged file is put aside, under a name of its own, and told; nothing of it is lost.

    Raises:
        OSError: the file cannot be read, or not put aside.
    """
    path = path or data_folder() / FILE
    scores = HighScores(path)
    try:
        scores._read()
    except ValueError as error:
        aside = next(
            each for k in count(1) if not (each := path.with_name(f"{path.stem}-damaged-{k}{path.suffix}")).exists()
        )
        path.replace(aside)
        first = str(error).splitlines()[0]
        return HighScores(path, f"the high-score file is damaged and was renamed to {aside}: {first}")
    return scores


def data_folder() -> Path:
    """Return where a user's data lies: `SANDBOX_DATA`, or as the platform has it."""
    stated = os.environ.get(FOLDER)
    if stated:
        return Path(stated)
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "sandbox"
    # Source: XDG Base Directory Specification, 0.8: $XDG_DATA_HOME, else ~/.local/share; a relative path counts not.
    home = Path(os.environ.get("XDG_DATA_HOME", ""))
    return (home if home.is_absolute() else Path.home() / ".local" / "share") / "sandbox"


def table_of(scene: Scene) -> str:
    """Return what a scene's scores are kept under: its game, and its title."""
    return f"{scene.play.game}: {scene.title}"


def initials_of(text: str) -> str:
    """Return up to three capital letters, digits, blanks, dots or dashes of a text; one without any is `---`."""
    return re.sub(r"[^A-Z0-9 .\-]", "", text.upper())[:LETTERS].strip() or "-" * LETTERS


def _as_rows(document: Any) -> Any:
    """Return a document with its pairs as tuples, as they were before JSON."""
    if not isinstance(document, dict):
        return document
    return {
        name: [tuple(row) if isinstance(row, list) else row for row in rows] if isinstance(rows, list) else rows
        for name, rows in document.items()
    }
