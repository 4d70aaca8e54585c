"""`sandbox run` of many runs: samples, summaries, dry runs, time limits, and sweeps too large for a table."""

import json
import re
from pathlib import Path

import pytest

from sandbox.cli import progress
from sandbox.cli import run_batch as module
from tests.cli.calling import DROP, SPARKS, document_of, json_of, lines_of, write_scene

pytestmark = pytest.mark.full  # command lines that run long


@pytest.fixture
def scene(tmp_path: Path) -> str:
    return write_scene(tmp_path, DROP + SPARKS)


def test_samples_are_drawn_from_ranges_and_multiply_with_sweeps(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("--sweep", "ball.a.restitution=0:1", "--sweep", "solver.dt=0.005:0.02:log", "--sample", "4:sobol:3")
    status, document, _ = json_of(capfd, "run", scene, *words, "--sweep", "ball.a.mass=1,2")
    assert status == 0
    points = [run["set"] for run in document["runs"]]
    assert [list(point) for point in points] == [["ball.a.mass", "ball.a.restitution", "solver.dt"]] * 8
    assert [point["ball.a.mass"] for point in points] == [1] * 4 + [2] * 4
    drawn = [(point["ball.a.restitution"], point["solver.dt"]) for point in points]
    assert drawn[:4] == drawn[4:]
    assert len(set(drawn)) == 4
    assert all(0.0 <= e < 1.0 and 0.005 <= dt < 0.02 for e, dt in drawn)
    assert json_of(capfd, "run", scene, *words, "--sweep", "ball.a.mass=1,2")[1]["runs"][0]["set"] == points[0]


def test_sweep_without_a_count_needs_a_sample(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, _, err = lines_of(capfd, "run", scene, "--sweep", "solver.dt=0.005:0.02")
    assert (status, len(err)) == (2, 1)
    assert "--sample N draws from it" in err[0]
    status, _, err = lines_of(capfd, "run", scene, "--sample", "3")
    assert (status, err[0].startswith("--sample: needs a range")) == (2, True)


def test_uneven_number_of_sobol_points_is_reported(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--sweep", "ball.a.restitution=0:1", "--sample")
    status, _, err = lines_of(capfd, *words, "5:sobol")
    assert (status, len(err)) == (0, 1)
    assert err[0].endswith("for powers of two, such as 4 or 8")
    assert lines_of(capfd, *words, "5")[2] == lines_of(capfd, *words, "8:sobol")[2] == []


def test_dry_run_estimates_and_runs_nothing(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--sweep", "solver.dt=0.005:0.02:100000", "--seeds", "100", "--out", str(tmp_path / "runs"))
    status, out, err = lines_of(capfd, *words, "--dry-run")
    assert (status, err) == (0, [])
    assert out[0] == "10,000,000 runs: 1 scene; 100,000 × solver.dt; 100 seeds"
    assert out[1] == f"first: {scene} pymunk solver.dt=0.005 world.seed=1"
    assert re.fullmatch(r"about \d+ (h|days) on 1 worker, .* a run; measured on 2 runs, not stored", out[2])
    assert not (tmp_path / "runs").exists()
    status, document, _ = json_of(capfd, *words[:2], "--seeds", "3", "--dry-run")
    assert (status, document["runs"], document["seeds"], document["measured"]) == (0, 3, 3, 1)
    assert document["seconds"] == pytest.approx(3 * document["seconds_per_run"])


def test_dry_run_counts_stored_runs(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--out", str(tmp_path / "runs"))
    json_of(capfd, *words, "--seeds", "2")
    assert json_of(capfd, *words, "--seeds", "5", "--dry-run")[1]["stored"] == 2
    assert json_of(capfd, *words, "--seeds", "5", "--dry-run", "--force")[1]["stored"] == 0


def test_summaries_have_rows_and_no_files(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--seeds", "2", "--out", str(tmp_path / "runs"))
    _, first, _ = json_of(capfd, *words, "--keep", "summary")
    assert [run["path"] for run in first["runs"]] == [None, None]
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["runs.sqlite"]
    _, again, _ = json_of(capfd, *words, "--keep", "summary")
    assert again["runs"] == [run | {"repeated": True} for run in first["runs"]]
    _, whole, _ = json_of(capfd, *words)
    assert [run["repeated"] for run in whole["runs"]] == [False, False]
    assert all(Path(run["path"]).is_file() for run in whole["runs"])
    assert [run["state_hash"] for run in whole["runs"]] == [run["state_hash"] for run in first["runs"]]


def test_force_repeats_stored_runs(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--seeds", "2", "--out", str(tmp_path / "runs"))
    json_of(capfd, *words)
    _, document, _ = json_of(capfd, *words, "--force")
    assert [run["repeated"] for run in document["runs"]] == [False, False]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_run_that_takes_too_long_is_stopped_and_the_others_complete(
    workers: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path, DROP + "[solver]\nrecord_every = 1000000\n")
    words = ("run", scene, "--sweep", "world.duration=0.1,100000,0.2", "--time-limit", "1", "--workers", workers)
    status, document, err = json_of(capfd, *words, "--out", str(tmp_path / "runs"))
    assert (status, [run["status"] for run in document["runs"]]) == (1, ["ok", "failed", "ok"])
    assert err == [f"{scene}: failed: stopped at the time limit of 1 s"]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_sweep_too_large_for_a_table_prints_a_summary(
    workers: str, scene: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, small, _ = json_of(capfd, "run", scene, "--seeds", "6")
    monkeypatch.setattr(module, "MAX_TABLE", 4)
    status, out, err = lines_of(capfd, "run", scene, "--seeds", "6", "--workers", workers)
    assert (status, err) == (0, [])
    assert out == ["6 runs: 6 ok; `sandbox runs DIR` lists and summarises the stored ones"]
    status, text, _ = lines_of(capfd, "run", scene, "--seeds", "6", "--workers", workers, "--json")
    large = document_of("\n".join(text))
    assert (status, large["interrupted"]) == (0, False)
    assert [run["id"] for run in large["runs"]] == [run["id"] for run in small["runs"]]  # in the order of the plan
    assert [run["final"] for run in large["runs"]] == [run["final"] for run in small["runs"]]


def test_problems_of_many_runs_are_counted(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_PROBLEMS", 2)
    words = ("run", write_scene(tmp_path), "--engine", "pymunk", "--set", "solver.integrator=rk4")
    status, _, err = lines_of(capfd, *words, "--sweep", "solver.dt=0.01:0.02:5", "--quiet")
    assert (status, len(err)) == (1, 3)
    assert err[2] == "… and 3 more runs that are not ok"


def test_long_sweep_reports_its_progress_in_lines(
    scene: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "PLAIN_INTERVAL", 0.0)
    _, _, err = lines_of(capfd, "run", scene, "--seeds", "3")
    assert [line.partition(";")[0] for line in err] == [f"{k} of 3 runs done" for k in (1, 2, 3)]
    assert re.search(r"runs/s; .* left; slowest .* s: .* world\.seed=\d", err[-1])
    assert lines_of(capfd, "run", scene, "--seeds", "3", "--quiet")[2] == []
    assert lines_of(capfd, "run", scene, "--seeds", "3", "--json")[2] == []


def test_fault_of_a_scene_beyond_the_checked_ones_is_reported(
    scene: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.batch.plan.MAX_CHECKED", 3)
    monkeypatch.setattr("sandbox.batch.plan.MAX_AXIS_CHECKED", 2)
    words = ("run", scene, "--sweep", "ball.a.mass=1,2,-3,4", "--json")
    status, text, err = lines_of(capfd, *words)
    assert status == 1
    assert [run["set"]["ball.a.mass"] for run in json.loads(text[0])["runs"]] == [1, 2, 4]
    assert len(err) == 1
    assert "is -3" in err[0]


def test_cluster_and_workers_exclude_each_other(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, _, err = lines_of(capfd, "run", scene, "--on", "tcp://127.0.0.1:1", "--workers", "2")
    assert (status, err) == (2, ["--workers: is given with --on too; leave out one of them"])


def test_ends_of_many_runs_are_computed_in_one_call(
    tmp_path: Path, scene: str, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path, DROP, "balls.toml")
    sweep = ("run", scene, "--engine", "exact", "--sweep", "ball.a.velocity=[0,0],[1,0],[0,2]")
    status, document, err = json_of(capfd, *sweep, "--keep", "end")
    assert status == 0
    assert err == []  # nothing beside the document
    status, _, err = lines_of(capfd, *sweep, "--keep", "end", "--out", str(tmp_path / "runs"))
    assert (status, err) == (0, [f"{scene}: exact computes many runs in one compiled call (--keep end)"])
    for row, ordinary in zip(document["runs"], json_of(capfd, *sweep)[1]["runs"], strict=True):
        assert (row["contacts"], row["missed_contacts"], row["first_contact"], row["work"]) == (None, None, None, {})
        same = ("id", "seed", "set", "status", "steps", "energy_start", "energy_end", "final", "state_hash")
        assert {key: row[key] for key in same} == {key: ordinary[key] for key in same}
    status, _, err = lines_of(capfd, *sweep, "--keep", "end", "--audit")
    assert (status, err[0].startswith("--audit: counts contacts")) == (2, True)
    status, out, _ = lines_of(capfd, *sweep, "--keep", "end", "--dry-run")
    assert (status, out[0]) == (0, "3 runs: 1 scene; 3 × ball.a.velocity")
    assert out[2].endswith("measured on 2 runs, not stored")
