"""Spread: random errors of a player's strokes."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
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


def strayed(stroke: Stroke, errors: FloatArray) -> Sequence[Stroke | None]:
    """Return a stroke with each of some errors; None for a miscue: the tip slips off, or the speed is not positive.

    Args:
        stroke: the intended stroke.
        errors: (M, 4) as `Spread.draw` returns them.
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
    """Return the strokes that do not miscue, and the mask (M,) of these."""
    return [each for each in strokes if each is not None], np.asarray([each is not None for each in strokes], np.bool_)
