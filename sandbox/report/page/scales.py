"""Scales: from values to places along an axis, with the ticks that suit them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from sandbox.report.page.wording import MINUS, number, power_of

STILL = 1e-6
"""An axis spans at least this share of its values: rounding is not blown up to full height."""
NOTHING = 1e-200
"""Values no farther from 0 are as good as 0: shares of them may be too small for a number."""

STEPS = (1, 2, 5)
"""What ticks are multiples of, times a power of ten."""


class Tick(NamedTuple):
    """A value that is marked."""

    value: float
    label: str


class Scale(Protocol):
    """What every scale can do."""

    @property
    def low(self) -> float:
        """The value at its low end."""
        ...

    @property
    def high(self) -> float:
        """The value at its high end."""
        ...

    def share(self, value: float) -> float:
        """Return how far along the axis a value lies: 0 at its low end, 1 at its high end."""
        ...

    def ticks(self, most: int) -> Sequence[Tick]:
        """Return about so many ticks at most, ascending."""
        ...


@dataclass(frozen=True)
class Linear:
    """Equal steps for equal differences."""

    low: float
    high: float

    @classmethod
    def around(cls, low: float, high: float, room: float = 0.05) -> "Linear":
        """Return a scale that holds two values with some room beside them, as a share of their distance."""
        short = STILL * max(abs(low), abs(high)) - (high - low)
        if max(abs(low), abs(high)) <= NOTHING:
            short = 1.0
        if short > 0.0:
            low, high = low - 0.5 * short, high + 0.5 * short
        return cls(low - room * (high - low), high + room * (high - low))

    def share(self, value: float) -> float:
        """Return how far along the axis a value lies."""
        return (value - self.low) / (self.high - self.low)

    def ticks(self, most: int) -> Sequence[Tick]:
        """Return ticks at multiples of 1, 2 or 5 times a power of ten."""
        rough = (self.high - self.low) / max(most, 1)
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= rough * (1.0 - 1e-9))
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [Tick(k * step, f"{k * step + 0.0:,.{digits}f}".replace("-", MINUS)) for k in range(first, last + 1)]


@dataclass(frozen=True)
class Log:
    """Equal steps for equal ratios; what is 0 or less lies at the low end."""

    low: float
    high: float

    @classmethod
    def around(cls, low: float, high: float, room: float = 0.0) -> "Log":
        """Return a scale of whole powers of ten that holds two positive values, at least two powers long.

        Args:
            low: the lower.
            high: the higher.
            room: powers of ten that are left free beyond either.
        """
        first, last = math.floor(math.log10(low) - room + 1e-9), math.ceil(math.log10(high) + room - 1e-9)
        if last - first < 2:
            first, last = first - 1, max(last, first + 1)
        return cls(10.0**first, 10.0**last)

    @classmethod
    def snug(cls, low: float, high: float) -> "Log":
        """Return a scale from 1, 2 or 5 times a power of ten to another, with some room beside the values."""
        low, high = low / 1.1, high * 1.1
        down, up = 10.0 ** math.floor(math.log10(low)), 10.0 ** math.floor(math.log10(high))
        return cls(max(k * down for k in STEPS if k * down <= low), min(k * up for k in (*STEPS, 10) if k * up >= high))

    def share(self, value: float) -> float:
        """Return how far along the axis a value lies."""
        if value <= self.low:
            return 0.0
        return math.log10(value / self.low) / math.log10(self.high / self.low)

    def ticks(self, most: int) -> Sequence[Tick]:
        """Return ticks at powers of ten, every so many that they do not crowd; of few, also at 2 and 5 times them."""
        first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
        if 3 * (last - first + 1) <= most and last - first < 3:
            every = [k * 10.0**power for power in range(first - 1, last + 1) for k in STEPS]
            return [Tick(v, number(v)) for v in every if self.low * (1 - 1e-9) <= v <= self.high * (1 + 1e-9)]
        step = max(1, math.ceil((last - first) / max(most, 1)))
        return [Tick(10.0**k, _power(k)) for k in range(math.ceil(first / step) * step, last + 1, step)]


def _power(exponent: int) -> str:
    return {-2: "0.01", -1: "0.1", 0: "1", 1: "10", 2: "100"}.get(exponent, f"10{power_of(exponent)}")
