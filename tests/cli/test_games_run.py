"""`sandbox run`, `check` and `replay` of games: scores, players, replayed sessions."""

import json
from pathlib import Path

import pytest

from sandbox.batch.find_run import read_run
from sandbox.batch.store import Store
from sandbox.cli.window import _computed
from sandbox.measure.run.sessions import play_out
from sandbox.scene.files.load import load
from sandbox.trajectory import Trajectory
from tests.cli.calling import json_of, lines_of, process, write_scene
from tests.toy_game import TOY, Toy

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Toy)


@pytest.fixture
def scene(tmp_path: Path) -> str:
    return write_scene(tmp_path, TOY, "toy.toml")


def test_row_of_a_game_has_score_and_player(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "run", scene)
    (row,) = document["runs"]
    game = play_out(load(scene))
    assert (status, err) == (0, [])
    assert (row["score"], row["over"], row["player"], row["otherwise"]) == (game.score, None, "random", None)
    assert row["state_hash"] == game.recording.state_hash
    assert "scores" not in document
    assert (
        json_of(capfd, "run", scene, "--player", "none")[1]["runs"][0]["score"] == play_out(load(scene), "none").score
    )


def test_table_has_a_score_column_only_with_games(scene, tmp_path, capfd):
    _, lines, _ = lines_of(capfd, "run", scene, "--player", "none")
    assert lines[1].split()[-2:] == ["score", "game"]
    assert lines[2].endswith("in progress")
    plain = write_scene(tmp_path, TOY.replace('game = "landing"', ""), "plain.toml")
    _, lines, _ = lines_of(capfd, "run", scene, plain, "--player", "none")
    # a scene without a game has no score
    assert [line.split()[-2:] for line in lines if "plain" in line] == [["–", "–"]]
    _, lines, _ = lines_of(capfd, "run", plain)
    assert "score" not in lines[1]
    assert "score" not in json_of(capfd, "run", plain)[1]["runs"][0]


def test_seeds_give_a_distribution_of_scores(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    _, document, err = json_of(capfd, "run", scene, "--seeds", "8")
    scores = [row["score"] for row in document["runs"]]
    (spread,) = document["scores"]
    assert err == []
    assert (spread["count"], spread["mean"]) == (8, pytest.approx(sum(scores) / 8))
    assert (spread["quantiles"]["0"], spread["quantiles"]["1"]) == (min(scores), max(scores))
    assert sum(spread["histogram"]["counts"]) == 8
    _, lines, _ = lines_of(capfd, "run", scene, "--seeds", "8")
    index = next(k for k, line in enumerate(lines) if line.startswith("scores of"))
    assert lines[index].endswith("pymunk: 8 games, player random")
    assert f"mean {spread['mean']:.4g}" in lines[index + 1]
    assert len(lines) == index + 3 + len(spread["histogram"]["counts"])
    assert max(line.count("█") for line in lines) == 40


def test_store_has_the_score_and_separates_players(scene, tmp_path, capfd):
    out = str(tmp_path / "runs")
    first = json_of(capfd, "run", scene, "--out", out)[1]["runs"][0]
    again = json_of(capfd, "run", scene, "--out", out)[1]["runs"][0]
    other = json_of(capfd, "run", scene, "--out", out, "--player", "none")[1]["runs"][0]
    assert (again["repeated"], again["score"], again["id"]) == (True, first["score"], first["id"])
    assert (other["repeated"], other["id"] != first["id"]) == (False, True)
    with Store(out) as store:
        assert [row.score for row in store.rows()] == [first["score"], other["score"]]


def test_script_is_accepted_as_a_player(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    script = write_scene(tmp_path, "0.1, kick, 1\n0.2, kick, 0\n", "script.txt")
    row = json_of(capfd, "run", scene, "--player", script)[1]["runs"][0]
    assert row["player"] == script
    assert row["score"] % 1.0 == 0.5
    bad = write_scene(tmp_path, "0.1, jump, 1\n", "bad.txt")
    status, _, err = json_of(capfd, "run", scene, "--player", bad)
    assert (status, len(err)) == (2, 1)
    assert err[0].startswith(f"{bad}:1: ") and "'jump'" in err[0]


def test_game_of_bots_only_needs_no_player(capfd: pytest.CaptureFixture[str]) -> None:
    alone = ("--set", "play.curling.people=0", "--set", "world.duration=1")
    assert lines_of(capfd, "run", "curling", "--player", "none", *alone)[0] == 0


def test_session_is_replayed_with_its_score_and_forgeries_are_detected(scene, tmp_path, capfd):
    game = play_out(load(scene))
    file = game.recording.save(tmp_path / "session.json")
    status, document, err = json_of(capfd, "run", str(file))
    (row,) = document["runs"]
    assert (status, err) == (0, [])
    assert (row["replayed"], row["score"], row["player"]) == (True, game.score, "as recorded")

    forged = json.loads(file.read_text())
    forged["score"] += 100
    file.write_text(json.dumps(forged))
    assert json_of(capfd, "run", str(file))[0] == 1

    forged["score"] -= 100
    kick = next(action for action in forged["actions"] if action["kind"] == "impulse" and action["time"] > 0.1)
    kick["impulse"] = [5.0, 5.0]
    file.write_text(json.dumps(forged))
    status, document, err = json_of(capfd, "run", str(file))
    assert (status, document["runs"][0]["replayed"], document["runs"][0]["otherwise"]) == (1, False, kick["time"])
    assert f"ended in a different game, from {kick['time']:g} s on," in err[0]


def test_stored_game_is_replayed_for_the_window(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "runs"
    row = json_of(capfd, "run", scene, "--out", str(out))[1]["runs"][0]
    stored = read_run(Path(row["path"]), row["path"])
    assert isinstance(stored, Trajectory)
    live = _computed(stored, "pymunk")
    for _ in live.session.seek(row["steps"]):
        pass
    assert live.session.game.rules.score == row["score"]
    assert live.session.game.diverged_at is None
    live.close()


def test_check_prints_the_game_and_its_controls() -> None:
    output = process("check", "landing").stdout
    assert "game landing: engine (up), turn left (left), turn right (right)\n" in output


def test_scene_without_the_elements_of_its_game_is_a_fault_with_its_line(tmp_path, capfd, monkeypatch):
    monkeypatch.undo()  # the game has its own rules again
    scene = write_scene(tmp_path, TOY, "lacking.toml")
    for command in ("run", "check", "play"):
        status, _, (line,) = lines_of(capfd, command, scene)
        assert status == 2
        assert line.startswith(f"{scene}:4: play.game: landing needs a body 'ship', a fixed element 'pad'")


def test_billiards_are_scored_only_with_a_player(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    run = ("run", "9-ball", "--engine", "exact", "--no-audit")
    assert "score" not in json_of(capfd, *run)[1]["runs"][0]
    by_bot = ("--player", "skilled", "--set", "world.duration=25", "--out", str(tmp_path))
    (row,) = json_of(capfd, *run, *by_bot)[1]["runs"]
    assert (row["player"], row["status"], row["otherwise"]) == ("skilled", "ok", None)
    assert row["score"] >= 0
