"""Shots as text lines: `cue hits 1`, `1 at rail`, `1 in corner`, in order; the events of a tuple are simultaneous."""

from collections.abc import Iterable
from typing import Any

from sandbox.games.billiards.rules.base import BallEvent, Ruleset, Ruling, ShotCall

KINDS = {"hits": "ball", "at": "cushion", "in": "pocket"}


def shot(*lines: str | tuple[str, ...]) -> tuple[BallEvent, ...]:
    return tuple(
        BallEvent(float(time), ball, KINDS[verb], other)
        for time, line in enumerate(lines)
        for ball, verb, other in (each.split() for each in ([line] if isinstance(line, str) else line))
    )


def judge(rules: Ruleset[Any], state: Any, *lines: str | tuple[str, ...], **call: Any) -> Ruling[Any]:
    return rules.judge(state, ShotCall(**call), shot(*lines))


def potted_lines(balls: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"{ball} in corner" for ball in balls)
