"""Choice of the only engine that has a setting, sweeps of `compare`, first contacts in the table of `run`."""

from pathlib import Path

import pytest

from tests.cli.calling import json_of, lines_of, write_scene

pytestmark = pytest.mark.full  # child processes and pages

SWEEP = ("--sweep", "solver.integrator=explicit_euler,velocity_verlet,rk4")


def test_compare_sweeps_integrators_on_the_only_engine_that_has_them(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, document, err = json_of(capfd, "compare", write_scene(tmp_path), *SWEEP)
    assert (status, err) == (
        0,
        ["engine: reference, the only one that has integrator explicit_euler, velocity_verlet, rk4"],
    )
    assert [row["engine"] for row in document["engines"]] == ["reference"] * 3
    assert [row["set"]["solver.integrator"] for row in document["engines"]] == [
        "explicit_euler", "velocity_verlet", "rk4",
    ]  # fmt: skip
    euler, verlet, rk4 = (row["max_position_error"] for row in document["engines"])
    assert euler > 5.0 * max(verlet, rk4)


def test_compare_prints_a_column_for_each_swept_setting(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "compare", write_scene(tmp_path), "--engine", "reference", *SWEEP)
    assert status == 0
    assert out[2].split()[:4] == ["engine", "integrator", "dt", "status"]
    assert [line.split()[1] for line in out[3:6]] == ["explicit_euler", "velocity_verlet", "rk4"]


def test_compare_refuses_a_value_that_a_named_engine_lacks(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", *SWEEP)
    assert status == 1
    assert [row["status"] for row in document["engines"]] == ["ok", "refused", "refused"]
    assert len(err) == 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--sweep", "solver.dt=1:2"), "--sweep"),
        (("--sweep", "solver.integratr=rk4"), "integratr"),
        ((*SWEEP, "--minimise"), "--minimise"),
        (("--sweep", "world.duration=0.1,0.2", "--out", "x"), "--out"),
    ],
)
def test_compare_reports_faults_of_sweeps(
    options: tuple[str, ...],
    words: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = lines_of(capfd, "compare", write_scene(tmp_path), *options)
    assert (status, out, len(err)) == (2, [], 1)
    assert words in err[0]


def test_sweep_of_the_solver_is_in_report_and_plot(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    status, _, _ = json_of(capfd, "compare", write_scene(tmp_path), "--engine", "reference", *SWEEP, "--out", str(out))
    assert status == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "reference, integrator velocity_verlet" in page
    assert (out / "error.png").read_bytes().startswith(b"\x89PNG")


def test_run_chooses_the_only_engine_that_has_a_setting(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "run", scene, "--set", "solver.integrator='rk4'")
    assert (status, err) == (0, ["engine: reference, the only one that has integrator rk4"])
    assert [run["engine"] for run in document["runs"]] == ["reference"]
    status, document, err = json_of(capfd, "run", scene, *SWEEP)
    assert (status, [run["engine"] for run in document["runs"]]) == (0, ["reference"] * 3)


def test_run_on_a_named_engine_without_the_setting_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    choice = ("--engine", "pymunk", "--set", "solver.integrator='rk4'")
    status, document, _ = json_of(capfd, "run", write_scene(tmp_path), *choice)
    assert (status, document["runs"][0]["engine"], document["runs"][0]["status"]) == (1, "pymunk", "refused")


def test_run_uses_pymunk_if_it_has_the_swept_values(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "run", write_scene(tmp_path), "--sweep", "solver.dt=0.01,0.005")
    assert (status, err, [run["engine"] for run in document["runs"]]) == (0, [], ["pymunk", "pymunk"])


def test_run_shows_first_contact_and_final_position(capfd: pytest.CaptureFixture[str]) -> None:
    detections = "solver.detection=discrete,bisect,swept,shrink"
    status, out, _ = lines_of(capfd, "run", "fast_ball", "--engine", "reference", "--sweep", detections)
    assert status == 0
    assert "first contact, s" in out[1]
    assert "final position, m" in out[1]
    assert len({line.split("(")[1] for line in out[2:6]}) > 1
    status, out, _ = lines_of(capfd, "run", "fast_ball", "--engine", "reference")
    assert any(line.startswith("first contact at ") and "final position (" in line for line in out)
