"""Attempt: a shot that is asked about: the table as it stands, whose ball is struck, and how it is meant."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sandbox.engines.exact.rolling.fan import Fan
from sandbox.engines.exact.rolling.outcome import Outcome
from sandbox.engines.exact.rolling.table import Table
from sandbox.scene.cue import Stroke
from sandbox.scene.model import Scene, default_name

Variable = Literal["aim", "speed", "side", "height"]
VARIABLES: tuple[Variable, ...] = ("aim", "speed", "side", "height")
UNITS: dict[Variable, str] = {"aim": "rad", "speed": "m/s", "side": "R", "height": "R"}


class NoSuchShotError(ValueError):
    """A scene has no such shot, ball or pocket; `str()` says which it has."""


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """A stroke on a table, and what it is to be called."""

    table: Table
    ball: str
    stroke: Stroke
    name: str

    @property
    def pockets(self) -> tuple[str, ...]:
        """The names of the table's pockets, in scene order."""
        scene = self.table.scene
        return scene.fixed_names[len(scene.fixed) :][: len(scene.pockets)]

    def number(self, ball: str) -> int:
        """Return a ball's number.

        Raises:
            NoSuchShotError: no ball has that name.
        """
        return _place(ball, self.table.names, "ball")

    def pocket(self, name: str) -> int:
        """Return a pocket's number, from 0.

        Raises:
            NoSuchShotError: no pocket has that name.
        """
        return _place(name, self.pockets, "pocket")

    def changed(self, variable: Variable, by: float) -> Stroke:
        """Return the stroke with one thing of it other than meant, in its own unit."""
        changed: Stroke = self.stroke.model_copy(update={variable: getattr(self.stroke, variable) + by})
        return changed

    def played(self, stroke: Stroke | None = None, ways: bool = False) -> Outcome:
        """Play a stroke, by default as it is meant.

        Raises:
            Exhaustion: as `Table.shoot`.
        """
        return self.table.shoot(self.stroke if stroke is None else stroke, self.ball, ways=ways)

    def fan(self, strokes: Sequence[Stroke], threads: int = 1) -> Fan:
        """Play many strokes, each for itself."""
        return self.table.fan(strokes, self.ball, threads=threads)

    def document(self) -> dict[str, Any]:
        """Return what is asked about as one JSON object."""
        asked: dict[str, float] = {variable: getattr(self.stroke, variable) for variable in VARIABLES}
        return {"name": self.name, "ball": self.ball, **asked, "cue_mass": self.stroke.cue_mass}


def attempt_of(scene: Scene | Attempt, shot: str | None = None) -> Attempt:
    """Return one of a scene's shots, to be asked about.

    Args:
        scene: with a `[surface]` and a `[[shot]]`; an attempt is returned as it is.
        shot: which, by its name; by default the first.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine lacks something.
    """
    if isinstance(scene, Attempt):
        return scene
    named = {each.name or default_name("shot", k): each for k, each in enumerate(scene.shots)}
    if not named:
        raise NoSuchShotError("the scene has no [[shot]]; state one, with `aim` and `speed`")
    name = next(iter(named)) if shot is None else shot
    found = named[_named(name, tuple(named), "shot")]
    stroke = Stroke(**{key: getattr(found, key) for key in Stroke.model_fields})
    return Attempt(Table(scene), found.ball, stroke, name)


def _named(name: str, names: Sequence[str], kind: str) -> str:
    return names[_place(name, names, kind)]


def _place(name: str, names: Sequence[str], kind: str) -> int:
    if name not in names:
        raise NoSuchShotError(f"no {kind} is named {name!r}; there are: {', '.join(names) or 'none'}")
    return list(names).index(name)
