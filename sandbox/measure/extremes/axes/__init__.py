"""Axes: what is driven to the extreme. A file a family; each lists its axes and pairs."""

from sandbox.measure.extremes.axes import crowding, falling, flying, hanging, hitting, overlapping, sliding, standing
from sandbox.measure.extremes.axis import Axis, Pair
from sandbox.measure.extremes.case import Case

_FAMILIES = (falling, flying, hitting, sliding, standing, hanging, crowding, overlapping)

AXES: dict[str, Axis] = {axis.name: axis for family in _FAMILIES for axis in family.AXES}
PAIRS: tuple[Pair, ...] = tuple(pair for family in _FAMILIES for pair in family.PAIRS)
CASES: dict[str, Case] = {axis.case.name: axis.case for axis in AXES.values()}
CASES |= {pair.case.name: pair.case for pair in PAIRS}
