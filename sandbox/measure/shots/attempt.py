"""Attempt: a shot to be analysed, with its table, the struck ball and the intended stroke."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sandbox.echo import short_repr
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.engines.exact.tabletop.shots import ShotBatch, Table
from sandbox.scene.description.scene import default_name
from sandbox.scene.description.surface import Stroke
from sandbox.scene.scene import Scene

Variable = Literal["aim", "speed", "side", "height"]
VARIABLES: tuple[Variable, ...] = ("aim", "speed", "side", "height")
UNITS: dict[Variable, str] = {"aim": "rad", "speed": "m/s", "side": "R", "height": "R"}


class NoSuchShotError(ValueError):
    """The scene has no such shot, ball or pocket; `str()` lists those that it has."""


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """Intended stroke at a ball of a table."""

    table: Table
    """the table before the stroke"""
    ball: str
    """name of the struck ball"""
    stroke: Stroke
    """intended stroke"""
    name: str
    """name of the shot"""

    def __repr__(self) -> str:
        """Return scene, shot, ball and stroke."""
        title = short_repr(self.table.scene.title)
        return f"<Attempt {title}: shot {short_repr(self.name)} at {short_repr(self.ball)}, {self.stroke!r}>"

    @property
    def pockets(self) -> tuple[str, ...]:
        """Names of the table's pockets, in scene order."""
        scene = self.table.scene
        return scene.fixed_names[len(scene.fixed) :][: len(scene.pockets)]

    def number(self, ball: str) -> int:
        """Return the index of a ball.

        Raises:
            NoSuchShotError: no ball has that name.
        """
        return _place(ball, self.table.names, "ball")

    def pocket(self, name: str) -> int:
        """Return the index of a pocket, from 0.

        Raises:
            NoSuchShotError: no pocket has that name.
        """
        return _place(name, self.pockets, "pocket")

    def changed(self, variable: Variable, by: float) -> Stroke:
        """Return the stroke with one variable changed by an amount in its unit."""
        changed: Stroke = self.stroke.model_copy(update={variable: getattr(self.stroke, variable) + by})
        return changed

    def played(self, stroke: Stroke | None = None, ways: bool = False) -> ShotResult:
        """Play a stroke; default: the intended stroke.

        Raises:
            Exhaustion: as `Table.shoot`.
        """
        return self.table.shoot(self.stroke if stroke is None else stroke, self.ball, ways=ways)

    def fan(self, strokes: Sequence[Stroke], threads: int = 1) -> ShotBatch:
        """Play many independent strokes."""
        return self.table.fan(strokes, self.ball, threads=threads)

    def document(self) -> dict[str, Any]:
        """Return the attempt as one JSON object."""
        asked: dict[str, float] = {variable: getattr(self.stroke, variable) for variable in VARIABLES}
        return {"name": self.name, "ball": self.ball, **asked, "cue_mass": self.stroke.cue_mass}


def attempt_of(scene: Scene | Attempt, shot: str | None = None) -> Attempt:
    """Return a shot of a scene for analysis.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`; an `Attempt` is returned unchanged.
        shot: name of the shot; default: the first.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
    """
    if isinstance(scene, Attempt):
        return scene
    named = {each.name or default_name("shot", k): each for k, each in enumerate(scene.shots)}
    if not named:
        raise NoSuchShotError("the scene has no [[shot]]; add one with `ball`, `aim` and `speed`")
    name = next(iter(named)) if shot is None else shot
    found = named[_named(name, tuple(named), "shot")]
    stroke = Stroke(**{key: getattr(found, key) for key in Stroke.model_fields})
    return Attempt(Table(scene), found.ball, stroke, name)


def _named(name: str, names: Sequence[str], kind: str) -> str:
    return names[_place(name, names, kind)]


def _place(name: str, names: Sequence[str], kind: str) -> int:
    if name not in names:
        raise NoSuchShotError(f"no {kind} is named {short_repr(name)}; known names: {', '.join(names) or 'none'}")
    return list(names).index(name)
