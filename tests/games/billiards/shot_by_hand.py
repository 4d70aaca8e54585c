"""Shots as text lines: `cue hits 1`, `1 at rail`, `1 in corner`, in order; the events of a tuple are simultaneous."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from sandbox.games.billiards.rules.base import BallEvent, Ruleset, Ruling, ShotCall

KINDS = {"hits": "ball", "at": "cushion", "in": "pocket"}
Lines = str | tuple[str | tuple[str, ...], ...]


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


class Case(NamedTuple):
    """A shot, and what its verdict or the state after it has; a single line may stand without its tuple."""

    state: Any
    lines: Lines
    expected: dict[str, Any]
    call: dict[str, Any] | None = None


def assert_case(rules: Ruleset[Any], case: Case) -> None:
    lines = (case.lines,) if isinstance(case.lines, str) else case.lines
    assert_verdict(judge(rules, case.state, *lines, **(case.call or {})), **case.expected)


def assert_verdict(verdict: Ruling[Any], **expected: Any) -> None:
    """Assert attributes of a verdict or else of its state; `respot` names balls, `down` and `up` balls of the table."""
    for name, value in expected.items():
        if name == "respot":
            assert tuple(each.ball for each in verdict.respot) == value
        elif name in ("down", "up"):
            assert (set(value) <= set(verdict.state.table)) is (name == "up")
            assert (set(value).isdisjoint(verdict.state.table)) is (name == "down")
        else:
            found = getattr(verdict, name) if hasattr(verdict, name) else getattr(verdict.state, name)
            assert found == value, (name, found)
