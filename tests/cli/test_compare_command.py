"""`sandbox compare`: output, JSON, files, exit status; choice of the only engine that has a setting."""

from pathlib import Path

import pytest

from sandbox.cli.main import call
from tests.cli.calling import DIVERGING, FAULTY, document_from, document_of, json_of, lines_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def test_json_has_the_errors(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "compare", scene, "--engine", "pymunk")
    assert (status, err) == (0, [])
    assert (document["scene"], document["title"], document["truth"]) == (scene, "Drop", "closed_form")
    (row,) = document["engines"]
    assert (row["engine"], row["status"], row["trusted_until"]) == ("pymunk", "ok", 0.5)
    # Half a metre at 10 m/s²: after 0.316 s explicit Euler is g·h·T/2 = 0.0158 m late.
    assert row["max_position_error"] > 0.0158
    assert (row["missed_contacts"], row["phantom_contacts"], row["matched_contacts"]) == (0, 0, 1)


def test_table_begins_with_the_ground_truth(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, out, err = lines_of(capfd, "compare", scene, "--engines", "pymunk")
    assert (status, err) == (0, [])
    assert out[0] == f"{scene}: Drop"
    assert out[1] == "truth: closed form (bouncing); trusted until 0.5 s of 0.5 s; tolerance 0.005 m"
    assert out[2].split()[:4] == ["engine", "dt", "max", "error,"]
    assert out[3].split()[:2] == ["pymunk", "0.01"]
    assert "rms" not in out[2]
    _, out, _ = lines_of(capfd, "compare", scene, "--engines", "pymunk", "-v")
    assert out[2].split()[:3] == ["engine", "dt", "status"]
    assert all(head in out[2] for head in ("rms error, m", "momentum", "after"))


def test_why_prints_a_table_of_changes_and_the_refusals(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", "--why")
    assert status == 0
    begin = next(k for k, line in enumerate(out) if line.startswith("pymunk: the most effective change is "))
    assert out[begin + 1].split("  ")[1] == "change"
    assert out[begin + 1].rstrip().endswith("of the original")
    changes = [line.split("  ")[1] for line in out[begin + 2 :]]
    assert "half_kick = True" in changes
    assert any(line.startswith("  refused: ") and "integrator = rk4" in line for line in out)


def test_out_writes_plots_report_and_json(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    document = document_from(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", "--out", str(out))
    names = ["comparison.json", "energy.png", "error.png", "report.html", "trajectories.png"]
    assert sorted(path.name for path in out.iterdir()) == names
    assert document_of((out / "comparison.json").read_text(encoding="utf-8")) == document
    assert "<h1><bdi>Drop</bdi></h1>" in (out / "report.html").read_text(encoding="utf-8")
    for name in (name for name in names if name.endswith(".png")):
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_refusal_of_a_named_engine_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    choice = ("--set", "solver.broad_phase='oriented'")
    status, document, err = json_of(capfd, "compare", scene, "--engine", "pymunk", *choice)
    assert status == 1
    assert (document["engines"][0]["status"], document["engines"][0]["max_position_error"]) == ("refused", None)
    assert [line.startswith(f"{scene}: pymunk refuses: ") for line in err] == [True]
    status, out, err = lines_of(capfd, "compare", scene, "--engine", "pymunk", *choice)
    assert status == 1
    assert len(err) == 1
    assert not any("pymunk refuses" in line for line in out)  # reported once, on stderr


def test_run_that_diverges_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", *DIVERGING)
    assert (status, document["engines"][0]["status"]) == (1, "diverged")
    assert "pymunk diverged" in err[0]


def test_all_faults_are_reported_together(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken").write_text("")
    scene = write_scene(tmp_path, FAULTY)
    arguments = ("compare", scene, "--engines", "nope,pymunk", "--out", str(tmp_path / "taken"), "--force")
    status, document, err = json_of(capfd, *arguments)
    assert (status, document["engines"], document["truth"]) == (2, [], None)
    assert len(err) == len(document["faults"]) == 5
    assert [line.split(":")[0] for line in err] == ["--engine", scene, scene, "--out", "--force"]


def test_sweeps_with_more_than_10_to_the_3000_runs_are_refused(capsys):
    sweeps = [part for k in range(900) for part in ("--sweep", f"solver.k{k}=1e-3:1e-2:100000")]
    status = call(["compare", "bounce", *sweeps])
    error = capsys.readouterr().err
    assert (status, error.count("\n")) == (2, 1)
    assert "sweeps multiply to more than 10^3,000 runs" in error


SWEEP = ("--sweep", "solver.integrator=explicit_euler,velocity_verlet,rk4")


def test_compare_sweeps_integrators_on_the_only_engine_that_has_them(tmp_path, capfd):
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


def test_compare_refuses_a_value_that_a_named_engine_lacks(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", *SWEEP)
    assert status == 1
    assert [row["status"] for row in document["engines"]] == ["ok", "refused", "refused"]
    assert len(err) == 2


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
    assert any(line.startswith("first contact at ") for line in out)
    (end,) = (line for line in out if line.startswith("ball"))
    assert end.endswith("  (0, 100)")  # at e = 1 it leaves as fast as it came
