"""Axes: the frame of a plot as SVG, and where values lie in it."""

from dataclasses import dataclass

from sandbox.report.page.markup import Markup, joined, tag
from sandbox.report.page.scales import Scale

ROW = 27.0
"""Units between ticks of an upright axis, at least."""
LETTER = 62.0
"""Units between ticks of a level one."""


@dataclass(frozen=True)
class Axes:
    """Two scales and the rectangle that they span; units are those of the picture, y down."""

    x: Scale
    y: Scale
    width: float = 560.0
    height: float = 250.0
    left: float = 52.0
    right: float = 12.0
    top: float = 26.0
    bottom: float = 36.0

    @property
    def inner_width(self) -> float:
        """Of the rectangle."""
        return self.width - self.left - self.right

    @property
    def inner_height(self) -> float:
        """Of the rectangle."""
        return self.height - self.top - self.bottom

    def across(self, value: float) -> float:
        """Return where a value lies along x."""
        return self.left + self.x.share(value) * self.inner_width

    def up(self, value: float) -> float:
        """Return where a value lies along y."""
        return self.top + (1.0 - self.y.share(value)) * self.inner_height

    def frame(self, x_label: str, y_label: str) -> Markup:
        """Return grid, ticks and the axes' names; that of y stands above it, so that nobody has to tilt the head."""
        parts: list[Markup] = []
        base, end = self.height - self.bottom, self.width - self.right
        for tick in self.y.ticks(int(self.inner_height / ROW)):
            y = self.up(tick.value)
            parts.append(tag("line", x1=self.left, x2=end, y1=y, y2=y, class_="grid"))
            parts.append(tag("text", tick.label, x=self.left - 7.0, y=y + 4.0, class_="tick end"))
        for tick in self.x.ticks(int(self.inner_width / LETTER)):
            x = self.across(tick.value)
            parts.append(tag("line", x1=x, x2=x, y1=base, y2=base + 4.0, class_="axis"))
            parts.append(tag("text", tick.label, x=x, y=base + 17.0, class_="tick middle"))
        parts.append(tag("line", x1=self.left, x2=end, y1=base, y2=base, class_="axis"))
        parts.append(tag("text", y_label, x=0.0, y=12.0, class_="label"))
        parts.append(tag("text", x_label, x=end, y=self.height - 3.0, class_="label end"))
        return joined(*parts)

    def clip(self, name: str, *children: Markup) -> Markup:
        """Return shapes cut off at the rectangle.

        Args:
            name: of the rectangle, the only one of that name on the page.
            children: what to cut.
        """
        size = {"width": self.inner_width, "height": self.inner_height + 2.0}
        box = tag("rect", x=self.left, y=self.top - 1.0, **size)
        return joined(tag("clipPath", box, id=name), tag("g", *children, clip_path=f"url(#{name})"))
