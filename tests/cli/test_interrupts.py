"""Ctrl-C in long commands: finished results are printed, and the exit status is 130."""

from collections.abc import Callable
from typing import Any

import pytest

import sandbox.cli.check as checking
import sandbox.measure.compare.comparison as comparing
import sandbox.measure.landing_error as missing
import sandbox.measure.shots.study as studying
from tests.cli.calling import json_of, lines_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def interrupt_at(monkeypatch: pytest.MonkeyPatch, module: Any, name: str, call: int) -> None:
    """Make a function of a module raise KeyboardInterrupt at its n-th call."""
    original: Callable[..., Any] = getattr(module, name)
    calls = []

    def interrupted(*args: Any, **kwargs: Any) -> Any:
        calls.append(name)
        if len(calls) == call:
            raise KeyboardInterrupt
        return original(*args, **kwargs)

    monkeypatch.setattr(module, name, interrupted)


def test_interrupted_compare_keeps_finished_engines(monkeypatch, capfd):
    interrupt_at(monkeypatch, comparing, "timed_run", 2)
    status, document, err = json_of(capfd, "compare", "bounce")
    assert (status, document["interrupted"], len(document["engines"])) == (130, True, 1)
    assert err == ["interrupted: 1 run complete; the results are kept"]


def test_compare_interrupted_in_its_first_run_prints_nothing(monkeypatch, capfd):
    interrupt_at(monkeypatch, comparing, "timed_run", 1)
    status, out, err = lines_of(capfd, "compare", "bounce")
    assert (status, out, err[-1]) == (130, [], "interrupted")


def test_interrupted_miss_keeps_finished_flights(monkeypatch, capfd):
    interrupt_at(monkeypatch, missing, "simulated_landing", 3)
    status, document, err = json_of(capfd, "miss", "duel")
    assert (status, document["interrupted"], len(document["rows"])) == (130, True, 2)
    assert err == ["interrupted: 2 flights are complete and kept"]


def test_interrupted_check_keeps_finished_scenes(tmp_path, monkeypatch, capfd):
    scenes = [write_scene(tmp_path, name=f"{k}.toml") for k in range(3)]
    interrupt_at(monkeypatch, checking, "_check", 2)
    status, document, err = json_of(capfd, "check", *scenes, "--no-trial")
    assert (status, [each["scene"] for each in document["scenes"]]) == (130, scenes[:1])
    assert err == ["interrupted: 1 of 3 scenes were checked"]


def test_interrupted_shots_keep_the_odds(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    interrupt_at(monkeypatch, studying, "sensitivity", 1)
    status, document, err = json_of(capfd, "shots", "9-ball", "--count", "3", "--sensitivity")
    assert (status, document["odds"]["count"], document["sensitivity"]) == (130, 3, None)
    assert err == ["interrupted: the odds and all other completed results are kept"]
