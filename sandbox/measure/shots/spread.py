"""Spread: by how much a player's strokes stray from what is meant, and strokes drawn so."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from sandbox.scene.cue import Stroke, miscues
from sandbox.scene.streams import Stream, draws
from sandbox.trajectory import BoolArray, FloatArray


@dataclass(frozen=True)
class Spread:
    """Standard deviations of normal errors, each independent of the others."""

    aim: float = 0.002
    """rad"""
    speed: float = 0.03
    """of the speed that is meant"""
    side: float = 0.0
    """of the radius"""
    height: float = 0.0
    """likewise"""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 <= value < float("inf"):
                raise ValueError(f"{name} = {value:g} is no spread; it is 0 or more, and finite")

    def draw(self, count: int, seed: int) -> FloatArray:
        """Return errors drawn at random, (M, 4): rad, share, of the radius twice.

        The first of many are those of few.
        """
        units = draws(Stream.SHOTS, seed).standard_normal((count, 4))
        return np.asarray(units * [self.aim, self.speed, self.side, self.height])


def strayed(stroke: Stroke, errors: FloatArray) -> Sequence[Stroke | None]:
    """Return a stroke with each of some errors; None where it miscues: the tip slips off, or never gets there.

    Args:
        stroke: as it is meant.
        errors: (M, 4) as `Spread.draw` gives them.
    """
    made: list[Stroke | None] = []
    for aim, speed, side, height in errors.tolist():
        one: Stroke = stroke.model_copy(
            update={
                "aim": stroke.aim + aim,
                "speed": stroke.speed * (1.0 + speed),
                "side": stroke.side + side,
                "height": stroke.height + height,
            }
        )
        made.append(None if miscues(one) or one.speed <= 0.0 else one)
    return made


def sound(strokes: Sequence[Stroke | None]) -> tuple[list[Stroke], BoolArray]:
    """Return the strokes that do not miscue, and (M,) which those are."""
    return [each for each in strokes if each is not None], np.asarray([each is not None for each in strokes], np.bool_)
