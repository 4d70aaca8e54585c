"""High scores: the ten best scores of each game and scene, in a JSON file in the data folder of the user.

The file maps each table, `<game>: <title of the scene>`, to a list of pairs of initials and score, the highest first.
"""

import json
import re
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, StringConstraints, TypeAdapter, ValidationError

from sandbox.atomic_write import atomic_write
from sandbox.resource_limits import read_limited
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import NestingError, check_text
from sandbox.user_folders import data_folder

FILE = "high-scores.json"

MAX_SCORES = 10
"""number of scores kept in each table"""

MAX_SCORE = 10**15
"""Bound of the absolute value of a score; larger values in a file count as damage."""

MAX_BYTES = 2**24
"""bound of the size of the file; a full table takes a few hundred bytes"""

LETTERS = 3
"""number of letters of the initials"""

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
    """Row of a table."""

    initials: str
    score: int | float


@dataclass(frozen=True)
class HighScores:
    """High-score file."""

    path: Path
    notice: str | None = None
    """message for the user that a damaged file was renamed; None if the file was valid"""

    def of(self, table: str) -> tuple[Entry, ...]:
        """Return the best scores of a table, the highest first.

        Raises:
            OSError: the file cannot be read.
            ValueError: the file is damaged.
        """
        return tuple(Entry(*row) for row in self._read().get(table, [])[:MAX_SCORES])

    def rank(self, table: str, score: int | float) -> int | None:
        """Return the rank that a score would have, from 1, after equal scores; None if it does not enter the table.

        Raises:
            OSError: the file cannot be read.
            ValueError: the file is damaged.
        """
        ahead = sum(each.score >= score for each in self.of(table))
        return ahead + 1 if score > 0 and ahead < MAX_SCORES else None

    def enter(self, table: str, initials: str, score: int | float) -> int | None:
        """Enter a score in a table and return its rank; None if it does not enter, which leaves the file unchanged.

        Raises:
            OSError: the file cannot be read or written.
            ValueError: the file is damaged.
        """
        rank = self.rank(table, score)
        if rank is None:
            return None
        tables = self._read()
        rows = tables.setdefault(table, [])
        rows.insert(rank - 1, (initials_of(initials), score))
        del rows[MAX_SCORES:]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(self.path) as temporary:
            temporary.write_text(json.dumps(tables, indent=1, ensure_ascii=False, sort_keys=True), encoding="utf-8")
        return rank

    def _read(self) -> dict[str, list[tuple[str, int | float]]]:
        try:
            text = read_limited(self.path, MAX_BYTES).decode("utf-8")
        except FileNotFoundError:
            return {}
        try:
            check_text(text)
            return _ENTRIES.validate_python(_as_rows(json.loads(text)))
        except (ValidationError, NestingError) as error:
            raise ValueError(f"{self.path} is not a high-score file: {str(error).splitlines()[0]}") from None


def opened(path: Path | None = None) -> HighScores:
    """Open the high scores. A damaged file is renamed to a new name, and `HighScores.notice` states so.

    Args:
        path: path of the file; default: in the data folder.

    Raises:
        OSError: the file cannot be read, a damaged file cannot be renamed, or the user has no folder for it.
    """
    path = path or data_folder() / FILE
    scores = HighScores(path)
    try:
        scores._read()
    except ValueError as error:
        renamed = next(
            each for k in count(1) if not (each := path.with_name(f"{path.stem}-damaged-{k}{path.suffix}")).exists()
        )
        path.replace(renamed)
        first = str(error).splitlines()[0]
        return HighScores(path, f"the high-score file is damaged and was renamed to {renamed}: {first}")
    return scores


def table_of(scene: Scene) -> str:
    """Return the name of the table of a scene: its game and its title."""
    return f"{scene.play.game}: {scene.title}"


def initials_of(text: str) -> str:
    """Return the first three capital letters, digits, blanks, dots or dashes of a text; `---` if it has none."""
    return re.sub(r"[^A-Z0-9 .\-]", "", text.upper())[:LETTERS].strip() or "-" * LETTERS


def _as_rows(document: Any) -> Any:
    """Return a JSON document with its rows converted from lists to tuples."""
    if not isinstance(document, dict):
        return document
    return {
        name: [tuple(row) if isinstance(row, list) else row for row in rows] if isinstance(rows, list) else rows
        for name, rows in document.items()
    }
