"""Courses: what befell a ball, and all those that it owes this to, in order.

Where two strokes lead a ball the same course, its rest is a smooth function of what lies between them; where a course
changes, as when a ball begins to miss another, it has a kink or a jump.
"""

from collections.abc import Mapping

from sandbox.engines.exact.tabletop.shot_result import ShotResult


def courses(outcome: ShotResult) -> Mapping[str, int]:
    """Return a number for each ball's course; equal courses have equal ones, within one process.

    What concerns other balls alone does not count, nor does in which order such things happen.
    """
    course = dict.fromkeys(outcome.names, 0)
    for event in outcome.events:
        own = course[event.ball]
        if event.kind == "ball" and event.partner is not None:
            other = course[event.partner]
            course[event.ball] = hash((event.kind, event.partner, own, other))
            course[event.partner] = hash((event.kind, event.ball, other, own))
        else:
            course[event.ball] = hash((event.kind, event.partner, own))
    return course
