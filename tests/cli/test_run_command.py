"""`sandbox run`: output, JSON, exit status."""

from dataclasses import replace
from pathlib import Path

import pytest

from sandbox.action import Impulse
from sandbox.engines.energy_ledger import Cause
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.cli.calling import (
    DIVERGING,
    DROP,
    FAULTY,
    SPARKS,
    document_from,
    json_of,
    lines_of,
    output_of,
    process,
    write_scene,
)

KEYS = {
    "id": str, "scene": str, "engine": str, "settings": dict, "seed": int, "status": str, "seconds": float,
    "steps": int, "steps_per_second": float, "realtime_factor": float, "energy_start": float, "energy_end": float,
    "contacts": int, "missed_contacts": int, "final": dict,
}  # fmt: skip
"""Types of the keys of a completed run that was not stored; `reason` and `path` are null then."""


def test_json_has_every_key_with_its_type(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "run", scene)
    assert (status, err, list(document)) == (0, [], ["runs", "interrupted"])
    assert document["interrupted"] is False
    (row,) = document["runs"]
    assert {key: type(row[key]) for key in KEYS} == KEYS
    assert (row["scene"], row["title"], row["engine"], row["status"]) == (scene, "Drop", "pymunk", "ok")
    assert (row["reason"], row["path"], row["seed"], row["steps"]) == (None, None, 0, 50)
    assert (row["settings"]["dt"], row["settings"]["integrator"]) == (0.01, "explicit_euler")
    assert row["settings"]["slop"] == pytest.approx(0.005)  # a hundredth of the smallest radius
    assert row["energy_start"] == 10.0  # m·g·y, y = 1 m
    assert (row["contacts"], row["missed_contacts"]) == (1, 0)
    assert row["steps_per_second"] == pytest.approx(50 / row["seconds"])
    assert row["realtime_factor"] == pytest.approx(0.5 / row["seconds"])
    final = row["final"]["a"]
    assert set(final) == {"position", "velocity", "angle", "angular_velocity"}
    assert [len(final["position"]), len(final["velocity"])] == [2, 2]
    assert (final["angle"], final["angular_velocity"]) == (0.0, 0.0)


def test_missed_contacts_are_unknown_without_audit(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    _, with_audit, _ = json_of(capfd, "run", scene)
    _, without, _ = json_of(capfd, "run", scene, "--no-audit")
    assert without["runs"][0]["missed_contacts"] is None
    assert without["runs"][0]["final"] == with_audit["runs"][0]["final"]
    assert lines_of(capfd, "run", scene, "--no-audit")[1][2].split()[-1] == "?"


@pytest.mark.fail_slow(60)  # takes over half a second
def test_process_in_another_folder_finds_both_kinds_of_scene(tmp_path: Path) -> None:
    write_scene(tmp_path)
    done = process("run", "drop.toml", "bounce", "--set", "world.duration=0.01", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["scene", "drop.toml", "bounce"]


def test_scenes_sweeps_and_seeds_are_combined(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    paths = [write_scene(tmp_path, DROP + SPARKS, name) for name in ("drop.toml", "other.toml")]
    sweeps = ("--sweep", "solver.dt=0.01,0.02", "--sweep", "solver.substeps=1:2:2", "--set", "ball.a.radius=0.4")
    status, document, _ = json_of(capfd, "run", *paths, *sweeps, "--engines", "pymunk, pymunk", "--seeds", "2")
    rows = [(r["scene"], r["settings"]["dt"], r["settings"]["substeps"], r["seed"]) for r in document["runs"]]
    assert status == 0
    assert rows == [(s, dt, n, seed) for s in paths for dt in (0.01, 0.02) for n in (1, 2) for seed in (1, 2)]
    assert len({r["id"] for r in document["runs"]}) == 8  # the two files are equal, so their runs are the same
    assert document["runs"][0]["set"] == {
        "ball.a.radius": 0.4,
        "solver.dt": 0.01,
        "solver.substeps": 1,
        "world.seed": 1,
    }


def test_seeds_of_a_deterministic_scene_give_one_run_and_a_message(tmp_path, capfd):
    scene, folder = write_scene(tmp_path), tmp_path / "runs"
    words = ("run", scene, "--seeds", "3", "--sweep", "solver.dt=0.01,0.02", "--out", str(folder))
    status, document, err = json_of(capfd, *words)
    assert (status, err) == (
        0,
        [f"{scene}: nothing is random, so the seeds 1 to 3 give one and the same run, which is made once"],
    )
    assert [(run["settings"]["dt"], run["seed"]) for run in document["runs"]] == [(0.01, 1), (0.02, 1)]
    assert len(list(folder.glob("*.npz"))) == 2
    message = f"{scene}: nothing is random, so all seeds give the same run"
    assert lines_of(capfd, "run", scene, "--sweep", "world.seed=1,2")[2] == [message]
    assert lines_of(capfd, "run", scene, "--seeds", "1")[2] == []
    random = write_scene(tmp_path, DROP + SPARKS, "sparks.toml")
    assert lines_of(capfd, "run", random, "--seeds", "2")[2] == []


def test_refused_run_is_reported_with_its_reason(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "run", scene, "--engine", "pymunk", "--set", "solver.integrator=rk4")
    (row,) = document["runs"]
    assert (status, row["status"], row["final"], row["steps"]) == (1, "refused", {}, 0)
    assert row["reason"].startswith("pymunk refuses: integrator 'rk4' is not supported")
    unknown = ("energy_start", "energy_end", "steps_per_second", "realtime_factor", "missed_contacts", "path")
    assert [row[key] for key in unknown] == [None] * 6
    assert err == [f"{scene}: refused: {row['reason']}; use --engine reference"]


def test_diverged_run_is_stored_up_to_its_divergence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "run", scene, *DIVERGING, "--out", str(tmp_path / "runs"))
    (row,) = document["runs"]
    assert (status, row["status"]) == (1, "diverged")
    assert err == [f"{scene}: diverged: {row['reason']}"]
    run = Trajectory.load(row["path"])
    assert (run.status, run.reason) == ("diverged", row["reason"])
    assert 1 < len(run.time) < 101
    assert f"at {run.time[-1]:g} s: 'a' " in row["reason"]
    assert row["final"]["a"]["position"] == run.position[-1, 0].tolist()


def test_faults_of_all_scenes_and_options_are_reported_together(tmp_path, capfd):
    bad, worse = write_scene(tmp_path, FAULTY, "bad.toml"), write_scene(tmp_path, FAULTY, "worse.toml")
    arguments = ("run", bad, worse, "nowhere", "--engine", "none", "--sweep", "dt")
    status, document, err = json_of(capfd, *arguments)
    assert (status, document["runs"]) == (2, [])
    locations = [(f["file"], f["line"], f["path"]) for f in document["faults"]]
    assert locations == [
        ("--engine", None, ""),
        ("nowhere", None, ""),
        ("--sweep", None, ""),
        *((file, line, path) for file in (bad, worse) for line, path in ((3, "ball.a.position"), (4, "ball.a.radius"))),
    ]
    assert len(err) == len(locations)
    assert err[3].startswith(f"{bad}:3: ball.a.position: ")
    assert lines_of(capfd, *arguments) == (2, [], err)


def test_run_beyond_the_memory_limit_is_refused_before_any_run(tmp_path, capfd):
    scene = write_scene(tmp_path, DROP + SPARKS.replace("count = 3", "count = 10_000"))
    huge = ("--set", "solver.dt=1e-9", "--set", "world.duration=1.0", "--out", str(tmp_path / "runs"))
    status, document, err = json_of(capfd, "run", "bounce", scene, *huge)
    assert (status, document["runs"], len(err)) == (2, [], len(document["faults"]))
    fault = document["faults"][-1]
    assert (fault["file"], fault["path"]) == (scene, "solver.record_every")
    assert "1,000,000,001 frames of 10,001 bodies take 4.8e+05 GB" in fault["message"]
    assert not (tmp_path / "runs").exists()


def test_quiet_prints_nothing_for_successful_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert lines_of(capfd, "run", write_scene(tmp_path), "--quiet") == (0, [], [])


def test_table_has_columns_for_swept_settings(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    _, out, _ = lines_of(capfd, "run", scene, "--sweep", "solver.iterations=5,10")
    assert out[0] == scene
    assert out[1].split("  ")[0] == "engine"
    assert (
        " ".join(out[1].split()) == "engine dt iterations status × real time energy, J first contact, s contacts missed"
    )
    assert [line.split()[2] for line in out[2:]] == ["5", "10"]


def test_table_has_a_column_of_broken_joints_if_any_broke(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rope = '[[rope]]\nname = "r"\nstart = [0, 5]\nend = [1, 5]\nlinks = 2\nmass = 1.0\nstrength = {}\n'
    for strength, column in (("1.0", "broken "), ("1e9", "")):
        path = tmp_path / f"{strength}.toml"
        path.write_text(f"world.gravity = [0, -9.81]\nworld.duration = 0.1\n{rope.format(strength)}", encoding="utf-8")
        _, out, _ = lines_of(capfd, "run", str(path))
        assert " ".join(out[1].split()) == f"engine dt status × real time energy, J joint error {column}contacts missed"


@pytest.mark.fail_slow(60)  # takes over half a second
def test_plot_is_written_and_reported(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, plot = write_scene(tmp_path), tmp_path / "run.svg"
    status, out, err = lines_of(capfd, "run", scene, "--plot", str(plot), "--body", "a")
    assert (status, out[-1], err) == (0, f"drawn: {plot}", [])
    assert "<svg" in plot.read_text(encoding="utf-8")
    status, document, _ = json_of(capfd, "run", scene, "--plot", str(tmp_path / "again.svg"))
    assert (status, len(document["runs"])) == (0, 1)
    assert (tmp_path / "again.svg").exists()


def test_plot_that_cannot_be_written_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    plot = tmp_path / ("x" * 300 + ".svg")  # longer than a file name may be
    status, _, err = lines_of(capfd, "run", write_scene(tmp_path), "--plot", str(plot))
    assert (status, len(err)) == (2, 1)
    assert err[0].startswith(f"--plot: {tmp_path}")
    assert err[0].endswith("x.svg: File name too long")


def recorded() -> Recording:
    """Return a session of the drop with the hash of its final state."""
    scene = loads(DROP)
    kick = Impulse(time=0.1, body="a", impulse=(1.0, 0.0))
    session = Recording(scene, "pymunk", scene.solver, (kick,), 0.4)
    return replace(session, state_hash=rerun(session).info["state_hash"])


def test_session_that_ends_in_the_recorded_state_is_replayed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    session = str(recorded().save(tmp_path / "session.json"))
    expected = recorded().state_hash
    for options in ([], ["--engine", "pymunk"], ["--out", str(tmp_path / "runs")], ["--out", str(tmp_path / "runs")]):
        document = document_from(capfd, "run", session, *options)
        assert [(row["state_hash"], row["replayed"]) for row in document["runs"]] == [(expected, True)]


def test_session_that_ends_in_another_state_is_status_1_and_one_line(tmp_path, capfd):
    session = str(replace(recorded(), state_hash="00ff").save(tmp_path / "session.json"))
    status, _, err = lines_of(capfd, "run", session)
    assert (status, len(err)) == (1, 1)
    assert err[0].startswith(f"{session}: ended in a different state")
    assert "another version" in err[0]
    status, document, _ = json_of(capfd, "run", session)
    assert (status, document["runs"][0]["replayed"]) == (1, False)


def test_session_with_changed_settings_is_not_compared(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    session = str(replace(recorded(), state_hash="00ff").save(tmp_path / "session.json"))
    for options in (["--engine", "reference"], ["--set", "solver.dt=0.005"], ["--seeds", "1"]):
        status, document, err = json_of(capfd, "run", session, *options)
        assert (status, err, document["runs"][0]["replayed"]) == (0, [], None)
    _, document, _ = json_of(capfd, "run", str(replace(recorded(), state_hash=None).save(tmp_path / "none.json")))
    assert document["runs"][0]["replayed"] is None
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path))
    assert "replayed" not in document["runs"][0]
    assert len(document["runs"][0]["state_hash"]) > 0


def test_table_shows_substeps_beside_dt(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "run", write_scene(tmp_path), "--set", "solver.substeps=4")
    assert out[1].split()[:4] == ["engine", "dt", "×", "substeps"]
    assert out[2].split()[1:4] == ["0.01", "×", "4"]
    _, out, _ = lines_of(capfd, "run", write_scene(tmp_path))
    assert out[1].split()[:3] == ["engine", "dt", "status"]


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_verbose_explains_every_column(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    swept = ("--sweep", "solver.iterations=5,10", "--sweep", "ball.a.restitution=0.1,0.9")
    for words in (("run", *swept), ("compare",), ("tradeoff", "--points", "2", "--tolerance", "1")):
        command, *options = words
        out = output_of(capfd, command, write_scene(tmp_path), *options, "--verbose")
        row = next(k for k, line in enumerate(out) if line.startswith("engine "))
        explained = {line[2:].partition("  ")[0] for line in out[row + 1 :] if line.startswith("  ")}
        unexplained = out[row]
        for column in sorted(explained, key=len, reverse=True):
            unexplained = unexplained.replace(column, "", 1)
        assert unexplained.split() == []


def test_missed_contact_of_a_single_run_is_named(capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "run", "bullet")
    assert out[-1] == "missed: contact of 'bullet' with 'wall' at 0.009 s"
    _, out, _ = lines_of(capfd, "run", "bullet", "--sweep", "solver.dt=0.0005,0.001")
    assert not any(line.startswith("missed:") for line in out)


def test_missed_contacts_beyond_the_named_ones_are_counted(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bullets = "[world]\nduration = 0.02\n[solver]\ndt = 0.01\n[[wall]]\npoints = [[1.25, -1], [1.25, 9]]\n"
    bullets += "".join(f"[[ball]]\nposition = [0, {k}]\nvelocity = [100, 0]\nradius = 0.1\n" for k in range(5))
    _, out, _ = lines_of(capfd, "run", write_scene(tmp_path, bullets))
    missed = [line for line in out if line.startswith("missed: ")]
    assert (len(missed), missed[-1]) == (4, "missed: and 2 more")


RUN = ("--engine", "reference", "--ledger")


def test_ledger_is_printed_by_cause(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    lines = output_of(capfd, "run", write_scene(tmp_path), *RUN)
    head = next(k for k, line in enumerate(lines) if line.startswith("energy of"))
    words = [line.split()[0] for line in lines[head + 1 :]]
    assert words == ["start", "restitution", "position", "integrator", "phantom", "sum", "end", "residual", "%:"]
    rows = {line.split()[0]: line.split()[1:] for line in lines[head + 1 :]}
    assert rows["start"] == ["10"]  # m·g·y, y = 1 m
    assert float(rows["restitution"][0]) == pytest.approx(-3.75, rel=0.1)  # (1 − e²) · 5 J, to the resolution of a step
    assert rows["phantom"] == ["0"]
    assert float(rows["start"][0]) + float(rows["sum"][0]) == pytest.approx(float(rows["end"][0]), abs=1e-3)  # 5 digits


def test_ledgers_of_runs_of_one_scene_are_columns_of_one_table(tmp_path, capfd):
    sweep = ("--sweep", "solver.integrator='explicit_euler','velocity_verlet'")
    _, lines, _ = lines_of(capfd, "run", write_scene(tmp_path), *RUN, *sweep)
    heads = [line for line in lines if line.startswith("energy of")]
    assert len(heads) == 1
    assert "integrator=explicit_euler" in heads[0]
    assert "integrator=velocity_verlet" in heads[0]
    integrator = next(line.split() for line in lines if line.split()[:1] == ["integrator"])
    assert integrator[-1] == "0"  # velocity Verlet is exact under gravity


def test_json_has_the_ledger_only_on_request(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), *RUN)
    ledger = document["runs"][0]["ledger"]
    assert list(ledger) == ["start", "causes", "end", "residual", "scale", "closes_to"]
    assert list(ledger["causes"]) == list(Cause)
    assert ledger["closes_to"] < 1e-9  # documented for the engines of this package
    assert ledger["end"] == document["runs"][0]["energy_end"]
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), "--engine", "reference")
    assert "ledger" not in document["runs"][0]


def test_refused_run_has_no_ledger(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "run", write_scene(tmp_path), *RUN, "--set", "solver.half_kick=true")
    assert (status, document["runs"][0]["status"], document["runs"][0]["ledger"]) == (1, "refused", None)
    status, lines, _ = lines_of(capfd, "run", write_scene(tmp_path), *RUN, "--set", "solver.half_kick=true")
    assert not any(line.startswith(("energy of", "%:")) for line in lines)


def test_refused_run_of_a_sweep_adds_no_columns(capfd: pytest.CaptureFixture[str]) -> None:
    springs = ("solver.response=penalty", "solver.damping=1")
    given = [word for each in springs for word in ("--set", each)]
    status, out, _ = lines_of(
        capfd, "run", "rest_depth", "--engine", "reference", *given, "--sweep", "solver.stiffness=1000,3000"
    )
    assert status == 1  # 3000 N/m would gain energy at 0.01 s
    assert out[1].split()[:4] == ["engine", "dt", "stiffness", "status"]
