"""`sandbox match`: frames, score, replayed sessions, faults, interrupt."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.games.billiards.headless import FrameRecord, NoRestError, play_frame
from sandbox.games.billiards.match import Match
from tests.cli.calling import json_of, lines_of

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

QUICK = ("match", "straight-rail", "--distance", "2", "--players", "bot:0.9,bot:0.8")


def test_frames_are_printed_and_counted(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, *QUICK, "--frames", "2")
    assert status == 0
    assert [line.partition(":")[0] for line in out] == ["frame 1", "frame 2", "2 frames"]
    assert "(bot:0.9)" in out[-1]


def test_document_has_every_turn_and_saved_sessions_replay(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, document, _ = json_of(capfd, *QUICK, "--frames", "2", "--seed", "5", "--out", str(tmp_path / "kept"))
    assert status == 0
    assert document["players"] == ["bot:0.9", "bot:0.8"]
    first, second = document["frames"]
    assert [first["seed"], second["seed"]] == [5, 6]
    assert [first["seats"], second["seats"]] == [[0, 1], [1, 0]]  # players take turns at breaking
    assert sum(document["wins"]) == sum(frame["winner"] is not None for frame in document["frames"])
    assert len(first["turns"]) >= first["shots"] == sum(turn.get("plan") is not None for turn in first["turns"])
    status, run, _ = json_of(capfd, "run", str(tmp_path / "kept" / "frame-2.json"), "--no-audit")
    assert (status, run["runs"][0]["replayed"]) == (0, True)


def test_same_seed_plays_the_same_frame(capfd: pytest.CaptureFixture[str]) -> None:
    first, second = (json_of(capfd, *QUICK, "--seed", "3")[1] for _ in range(2))
    assert first == second


def test_all_faults_are_reported_together(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "match", "9-ball", "--players", "cat", "--game", "snooker", "--engine", "none")
    assert (status, out) == (2, [])
    assert [line.partition(":")[0] for line in err] == ["--engine", "--players", "9-ball"]
    status, _, err = lines_of(capfd, "match", "9-ball", "--game", "chess")
    assert (status, "unknown game 'chess'" in err[0]) == (2, True)


def test_misses_option_switches_on_the_miss_rule_of_snooker(monkeypatch, capfd):
    states = []

    def record_state(match: Match, *_: object, **__: object) -> FrameRecord:
        states.append(match.state)
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.cli.games.play_frame", record_state)
    for options in ((), ("--misses",)):
        assert lines_of(capfd, "match", "snooker", *options)[0] == 130
    assert [state.misses for state in states] == [False, True]


def test_frame_beyond_the_turn_or_time_limit_is_abandoned_and_counted(tmp_path, capfd):
    endless = ("match", "three-cushion", "--players", "bot:0,bot:0", "--frames", "3")
    status, document, err = json_of(capfd, *endless, "--turns", "2", "--out", str(tmp_path))
    assert (status, document["unfinished"], document["wins"]) == (1, 3, [0, 0])
    assert [len(frame["turns"]) for frame in document["frames"]] == [2, 2, 2]
    assert [line.partition(":")[0] for line in err] == ["frame 1", "frame 2", "frame 3"]
    assert len(list(tmp_path.iterdir())) == 3
    status, out, err = lines_of(capfd, *endless, "--time-limit", "1e-9")
    assert (status, len(err)) == (1, 3)
    assert out[-1].endswith("abandoned 3")


@pytest.mark.parametrize("error", [NoRestError("no rest"), Divergence(1.0, "cue", "flies off"), Exhaustion("too many")])
def test_failed_shot_abandons_the_frame(error, monkeypatch, capfd):
    def failing(*_: object) -> None:
        raise error

    monkeypatch.setattr("sandbox.games.billiards.headless.play_shot", failing)
    status, document, (line,) = json_of(capfd, *QUICK)
    assert (status, document["unfinished"]) == (1, 1)
    assert str(error) in document["frames"][0]["unfinished"]
    assert str(error) in line


@pytest.mark.parametrize("as_json", [False, True])
def test_interrupted_match_keeps_finished_frames(as_json, monkeypatch, capfd):
    frames = []

    def interrupted(*args: Any, **kwargs: Any) -> FrameRecord:
        if frames:
            raise KeyboardInterrupt
        frames.append(play_frame(*args, **kwargs))
        return frames[0]

    monkeypatch.setattr("sandbox.cli.games.play_frame", interrupted)
    call_command = json_of if as_json else lines_of
    status, output, err = call_command(capfd, *QUICK, "--frames", "3")
    assert (status, err) == (130, ["interrupted: 1 of 3 frames are complete"])
    if as_json:
        assert (len(output["frames"]), output["interrupted"]) == (1, True)
    else:
        assert [line.partition(":")[0] for line in output] == ["frame 1", "1 frames"]
