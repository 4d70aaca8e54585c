"""`sandbox compare`: output, JSON, files, exit status."""

import json
from pathlib import Path

import pytest

from sandbox.cli import compare as module
from sandbox.cli.main import call
from tests.cli.calling import DIVERGING, FAULTY, document_of, json_of, lines_of, process, write_scene

pytestmark = pytest.mark.full  # child processes and command lines that run long

DOCUMENTED_KEYS = {
    "engine",
    "settings",
    "max_position_error",
    "rms_position_error",
    "energy_drift",
    "first_divergence",
    "missed_contacts",
    "phantom_contacts",
    "trusted_until",
    "seconds",
}


def test_json_has_the_documented_keys(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "compare", scene, "--engine", "pymunk")
    assert (status, err) == (0, [])
    assert (document["scene"], document["title"], document["truth"]) == (scene, "Drop", "closed_form")
    (row,) = document["engines"]
    assert set(row) >= DOCUMENTED_KEYS
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
    assert out[2].split()[:3] == ["engine", "dt", "status"]
    assert out[3].split()[:3] == ["pymunk", "0.01", "ok"]


def test_columns_are_explained_below_the_table(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "compare", write_scene(tmp_path), "--engines", "pymunk")
    below = "\n".join(out[4:])
    for word in ("error:", "diverges:", "energy,", "momentum:", "contacts:", "truth only,", "run only:", "after:"):
        assert word in below


def test_why_prints_a_table_of_changes_and_the_refusals(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", "--why")
    assert status == 0
    begin = next(k for k, line in enumerate(out) if line.startswith("pymunk: the most effective change is "))
    assert out[begin + 1].split("  ")[1] == "change"
    assert out[begin + 1].rstrip().endswith("of the original")
    changes = [line.split("  ")[1] for line in out[begin + 2 :]]
    assert "half_kick = True" in changes
    assert any(line.startswith("  refused: ") and "integrator = rk4" in line for line in out)


def test_missed_contact_is_named(capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "compare", "bullet", "--engine", "pymunk")
    assert out[-1].startswith("pymunk: truth only: bullet and wall at 0.009")


def test_quiet_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert lines_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", "--quiet") == (0, [], [])


def test_out_writes_plots_report_and_json(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    status, document, err = json_of(capfd, "compare", write_scene(tmp_path), "--engine", "pymunk", "--out", str(out))
    assert (status, err) == (0, [])
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
    arguments = ("compare", scene, "--engines", "nope,pymunk", "--out", str(tmp_path / "taken"), "--tolerance", "inf")
    status, document, err = json_of(capfd, *arguments)
    assert (status, document["engines"], document["truth"]) == (2, [], None)
    assert len(err) == len(document["faults"]) == 5
    assert [line.split(":")[0] for line in err] == ["--engine", scene, scene, "--tolerance", "--out"]


@pytest.mark.parametrize("tolerance", ["0", "-1", "x"])
def test_tolerance_out_of_range_is_status_2(tolerance: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "compare", write_scene(tmp_path), "--tolerance", tolerance)
    assert (status, out, len(err)) == (2, [], 1)
    assert "--tolerance" in err[0]


def test_frames_beyond_the_memory_limit_are_status_2(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    huge = ("--set", "world.duration=900000", "--set", "solver.dt=0.001", "--engine", "pymunk")
    status, out, err = lines_of(capfd, "compare", write_scene(tmp_path), *huge, "--quiet")
    assert (status, out, len(err)) == (2, [], 1)
    assert "GB" in err[0]


def test_unknown_scene_is_status_2(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "compare", "no_such_scene")
    assert (status, out, len(err)) == (2, [], 1)


def test_interrupt_is_status_130(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "compare_variants", interrupted)
    assert call(["compare", write_scene(tmp_path)]) == 130
    out, err = capfd.readouterr()
    assert (out, err.splitlines()[-1]) == ("", "interrupted")


def test_process_prints_one_json_document(tmp_path: Path) -> None:
    write_scene(tmp_path)
    done = process("compare", "drop.toml", "--engine", "pymunk", "--json", cwd=tmp_path)
    assert done.returncode == 0
    assert json.loads(done.stdout)["scene"] == "drop.toml"


def test_sweeps_with_more_than_10_to_the_3000_runs_are_refused(capsys):
    sweeps = [part for k in range(900) for part in ("--sweep", f"solver.k{k}=1e-3:1e-2:100000")]
    status = call(["compare", "bounce", *sweeps])
    error = capsys.readouterr().err
    assert (status, error.count("\n")) == (2, 1)
    assert "sweeps multiply to more than 10^3,000 runs" in error
