"""Knob: one figure or choice that can be turned while a scene runs, and how positions of a slider become values."""

import math
from dataclasses import dataclass

from sandbox.play.instruments.figures import figure, percent

Value = float | str


@dataclass(frozen=True)
class Knob:
    """What the panel shows of one setting. A value: turning it is reported, never done here."""

    key: str
    """what `on_change` calls it"""
    label: str
    low: float = 0.0
    high: float = 1.0
    value: Value = 0.0
    """now; one of `choices` where there are some"""
    log: bool = False
    """equal ways are equal factors; `low` is then above 0"""
    step: float = 0.01
    """what a notch of the wheel adds, and what values are whole multiples of; of a logarithmic knob, in decades"""
    unit: str = ""
    """with `%`, shares are shown in percent"""
    choices: tuple[str, ...] = ()
    enabled: bool = True
    why: str = ""
    """why it cannot be turned"""
    default: Value | None = None
    """the file's, which a double click goes back to"""

    @property
    def whole(self) -> bool:
        """Only whole numbers are meant."""
        return not self.log and self.step >= 1 and self.step == int(self.step)

    def at(self, share: float) -> float:
        """Return the value at a share of the way from `low` to `high`, snapped; the ends are exact."""
        if share <= 0 or self.high <= self.low:
            return self.low
        if share >= 1:
            return self.high
        if self.log:
            return self._snapped(self.low * (self.high / self.low) ** share)
        return self._snapped(self.low + share * (self.high - self.low))

    def share(self, value: Value) -> float:
        """Return where a value lies, 0 at `low` to 1 at `high`; one beyond lies at the end."""
        if isinstance(value, str) or not math.isfinite(value) or self.high <= self.low:
            return 0.0
        inside = min(max(value, self.low), self.high)
        if self.log:
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)

    def stepped(self, value: Value, notches: int) -> Value:
        """Return the value some notches of the wheel further; choices go round."""
        if self.choices:
            present = self.choices.index(str(value)) if value in self.choices else -1 if notches > 0 else 0
            return self.choices[(present + notches) % len(self.choices)]
        if isinstance(value, str) or not math.isfinite(value):
            return self.low
        if self.log:
            return self._snapped(value * 10.0 ** (self.step * notches))
        return self._snapped(value + self.step * notches)

    def _snapped(self, value: float) -> float:
        if self.log:
            digits = 1 if self.step >= 0.05 else 2 if self.step >= 0.005 else 12  # a notch is then never lost
            value = float(f"{value:.{digits}e}")
        elif self.step > 0:
            places = max(0, 2 - math.floor(math.log10(self.step)))  # multiples of 0.1 are not 0.30000000000000004
            value = round(round(value / self.step) * self.step, places)
        return min(max(value, self.low), self.high)

    def text(self, value: Value) -> str:
        """Return a value as it is shown."""
        if isinstance(value, str):
            return value.replace("_", " ")
        if self.unit == "%":
            return percent(value)
        if self.whole and math.isfinite(value):
            tail = f" {self.unit}" if self.unit else ""
            return f"{value:.0f}{tail}".replace("-", "−")
        return figure(value, self.unit)
