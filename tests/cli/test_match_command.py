"""`sandbox match`: frames, the score, sessions that replay, what is refused."""

from pathlib import Path

import pytest
from calling import json_of, lines_of

from sandbox.games.billiards.frame import Frame
from sandbox.games.billiards.match import Match

QUICK = ("match", "straight-rail", "--distance", "2", "--players", "bot:0.9,bot:0.8")


def test_frames_are_told_and_counted(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, *QUICK, "--frames", "2")
    assert status == 0
    assert [line.partition(":")[0] for line in out] == ["frame 1", "frame 2", "2 frames"]
    assert "(bot:0.9)" in out[-1]


def test_document_tells_every_turn_and_session_replays(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, document, _ = json_of(capfd, *QUICK, "--frames", "2", "--seed", "5", "--out", str(tmp_path / "kept"))
    assert status == 0
    assert document["players"] == ["bot:0.9", "bot:0.8"]
    first, second = document["frames"]
    assert [first["seed"], second["seed"]] == [5, 6]
    assert [first["seats"], second["seats"]] == [[0, 1], [1, 0]]  # the first shot goes round
    assert sum(document["wins"]) == sum(frame["winner"] is not None for frame in document["frames"])
    assert len(first["turns"]) >= first["shots"] == sum(turn.get("plan") is not None for turn in first["turns"])
    status, run, _ = json_of(capfd, "run", str(tmp_path / "kept" / "frame-2.json"), "--no-audit")
    assert (status, run["runs"][0]["replayed"]) == (0, True)


def test_same_seed_plays_the_same_frame(capfd: pytest.CaptureFixture[str]) -> None:
    one, two = (json_of(capfd, *QUICK, "--seed", "3")[1] for _ in range(2))
    assert one == two


def test_all_that_is_wrong_is_told_at_once(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "match", "9-ball", "--players", "cat", "--game", "snooker", "--engine", "none")
    assert (status, out) == (2, [])
    assert [line.partition(":")[0] for line in err] == ["--engine", "--players", "9-ball"]
    status, _, err = lines_of(capfd, "match", "9-ball", "--game", "chess")
    assert (status, "no game 'chess'" in err[0]) == (2, True)


def test_misses_are_of_snooker(capfd: pytest.CaptureFixture[str]) -> None:
    status, _, err = lines_of(capfd, "match", "9-ball", "--misses")
    assert (status, err) == (2, ["9-ball: 9-ball takes no misses"])


def test_snooker_is_played_with_the_miss(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    states = []

    def ended(match: Match, *_: object) -> Frame:
        states.append(match.state)
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.cli.match.play", ended)
    for more in ((), ("--misses",)):
        assert lines_of(capfd, "match", "snooker", *more)[0] == 130
    assert [state.misses for state in states] == [False, True]


def test_scene_without_a_floor_is_no_table(capfd: pytest.CaptureFixture[str]) -> None:
    status, _, err = lines_of(capfd, "match", "bounce")
    assert status == 2
    assert "is not a billiard table" in err[0]
