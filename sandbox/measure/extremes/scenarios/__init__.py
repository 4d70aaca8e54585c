"""Scenarios: the scenes whose parameters are varied to the extreme. Each module lists its axes and pairs of axes."""

from sandbox.measure.extremes.experiment import Axis, AxisPair, Scenario
from sandbox.measure.extremes.scenarios import impacts, many_body, stacks

AXES: dict[str, Axis] = {
    axis.name: axis
    for axes in (
        impacts.FALL_AXES,
        impacts.BULLET_AXES,
        impacts.HEAD_ON_AXES,
        stacks.SLIDE_AXES,
        stacks.STACK_AXES,
        many_body.JOINT_AXES,
        many_body.CROWD_AXES,
        stacks.OVERLAP_AXES,
    )
    for axis in axes
}
PAIRS: tuple[AxisPair, ...] = (
    *impacts.FALL_PAIRS,
    *impacts.BULLET_PAIRS,
    *impacts.HEAD_ON_PAIRS,
    *stacks.SLIDE_PAIRS,
    *stacks.STACK_PAIRS,
    *many_body.JOINT_PAIRS,
    *many_body.CROWD_PAIRS,
    *stacks.OVERLAP_PAIRS,
)
SCENARIOS: dict[str, Scenario] = {axis.case.name: axis.case for axis in AXES.values()}
SCENARIOS |= {pair.case.name: pair.case for pair in PAIRS}
