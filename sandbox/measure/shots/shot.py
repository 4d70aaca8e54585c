"""A shot to be analysed, and the execution noise of a player."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar, Literal

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.echo import short_repr
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.engines.exact.tabletop.shots import ShotBatch, Table
from sandbox.jsonable import in_json
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import default_name
from sandbox.scene.description.surface import Stroke, miscues
from sandbox.scene.random_streams import Stream, draws


@dataclass(frozen=True)
class Spread:
    """Standard deviations of the independent normal errors of a stroke.

    Raises:
        ValueError: a value is negative or not finite.
    """

    aim: float = 0.002
    """rad"""
    speed: float = 0.03
    """fraction of the intended speed"""
    side: float = 0.0
    """fraction of the ball radius"""
    height: float = 0.0
    """fraction of the ball radius"""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 <= value < float("inf"):
                raise ValueError(f"{name} = {value:g} is not a standard deviation; it must be 0 or more, and finite")

    def draw(self, count: int, seed: int) -> FloatArray:
        """Return random errors, (M, 4): aim in rad, speed as a fraction, side and height as fractions of the radius.

        A larger sample with the same seed begins with the smaller one.

        Args:
            count: M, the number of strokes.
            seed: seed of the random numbers.
        """
        units = draws(Stream.SHOTS, seed).standard_normal((count, 4))
        return np.asarray(units * [self.aim, self.speed, self.side, self.height])


def perturb_stroke(stroke: Stroke, errors: FloatArray) -> Sequence[Stroke | None]:
    """Return the strokes with some errors; None for a miscue: the tip slips off, or the speed is not positive.

    Args:
        stroke: the intended stroke.
        errors: (M, 4) as `Spread.draw` returns them.
    """
    made: list[Stroke | None] = []
    for aim, speed, side, height in errors.tolist():
        perturbed: Stroke = stroke.model_copy(
            update={
                "aim": stroke.aim + aim,
                "speed": stroke.speed * (1.0 + speed),
                "side": stroke.side + side,
                "height": stroke.height + height,
            }
        )
        made.append(None if miscues(perturbed) or perturbed.speed <= 0.0 else perturbed)
    return made


def without_miscues(strokes: Sequence[Stroke | None]) -> tuple[list[Stroke], BoolArray]:
    """Return the strokes that do not miscue, and the mask (M,) of these."""
    return [each for each in strokes if each is not None], np.asarray([each is not None for each in strokes], np.bool_)


Variable = Literal["aim", "speed", "side", "height"]
VARIABLES: tuple[Variable, ...] = ("aim", "speed", "side", "height")
UNITS: dict[Variable, str] = {"aim": "rad", "speed": "m/s", "side": "R", "height": "R"}


class NoSuchShotError(ValueError):
    """The scene has no such shot, ball or pocket; `str()` lists those that it has."""


@dataclass(frozen=True, eq=False, slots=True)
class ShotSetup:
    """Intended stroke at a ball of a table."""

    table: Table = field(metadata=in_json(omit=True))
    """the table before the stroke"""
    ball: str
    """name of the struck ball"""
    stroke: Stroke = field(metadata=in_json(inline=True))
    """intended stroke"""
    name: str
    """name of the shot"""

    json_head: ClassVar = ("name", "ball")
    json_name: ClassVar = "ShotDocument"

    def __repr__(self) -> str:
        """Return scene, shot, ball and stroke."""
        title = short_repr(self.table.scene.title)
        return f"<ShotSetup {title}: shot {short_repr(self.name)} at {short_repr(self.ball)}, {self.stroke!r}>"

    @property
    def pockets(self) -> tuple[str, ...]:
        """Names of the table's pockets, in scene order."""
        scene = self.table.scene
        return scene.fixed_names[len(scene.fixed) :][: len(scene.pockets)]

    def ball_index(self, ball: str) -> int:
        """Return the index of a ball.

        Raises:
            NoSuchShotError: no ball has that name.
        """
        return _index(ball, self.table.names, "ball")

    def pocket_index(self, name: str) -> int:
        """Return the index of a pocket, from 0.

        Raises:
            NoSuchShotError: no pocket has that name.
        """
        return _index(name, self.pockets, "pocket")

    def changed(self, variable: Variable, by: float) -> Stroke:
        """Return the stroke with one variable changed by an amount in its unit."""
        changed: Stroke = self.stroke.model_copy(update={variable: getattr(self.stroke, variable) + by})
        return changed

    def simulate(self, stroke: Stroke | None = None, record_paths: bool = False) -> ShotResult:
        """Play a stroke; default: the intended stroke.

        Raises:
            Exhaustion: as `Table.shoot`.
        """
        return self.table.shoot(self.stroke if stroke is None else stroke, self.ball, record_paths=record_paths)

    def simulate_batch(self, strokes: Sequence[Stroke], threads: int = 1) -> ShotBatch:
        """Play many independent strokes."""
        return self.table.fan(strokes, self.ball, threads=threads)


def shot_setup(scene: Scene | ShotSetup, shot: str | None = None) -> ShotSetup:
    """Return a shot of a scene for analysis.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`; an `ShotSetup` is returned unchanged.
        shot: name of the shot; default: the first.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
    """
    if isinstance(scene, ShotSetup):
        return scene
    named = {each.name or default_name("shot", k): each for k, each in enumerate(scene.shots)}
    if not named:
        raise NoSuchShotError("the scene has no [[shot]]; add one with `ball`, `aim` and `speed`")
    name = next(iter(named)) if shot is None else shot
    found = named[_require_name(name, tuple(named), "shot")]
    stroke = Stroke(**{key: getattr(found, key) for key in Stroke.model_fields})
    return ShotSetup(Table(scene), found.ball, stroke, name)


def _require_name(name: str, names: Sequence[str], kind: str) -> str:
    return names[_index(name, names, kind)]


def _index(name: str, names: Sequence[str], kind: str) -> int:
    if name not in names:
        raise NoSuchShotError(f"no {kind} is named {short_repr(name)}; known names: {', '.join(names) or 'none'}")
    return list(names).index(name)
