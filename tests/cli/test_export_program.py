"""`sandbox export SCENE --to game.py`: the program, refusals with all reasons, and options that do not apply."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.cli.main import call
from sandbox.measure.run.runner import run
from sandbox.pymunk_export import with_divided_walls
from sandbox.scene.files.load import load
from tests.cli.calling import DROP, json_of, lines_of, output_of, write_scene

ZONE = '\n[[zone]]\nname = "hole"\nposition = [0.0, 0.0]\nradius = 0.1\nholds = true\n'

FINAL_STATE = """
import json
import game

space, bodies = game.make_space()
for _ in range({steps}):
    game.step(space)
print(json.dumps({{name: [*body.position, *body.velocity] for name, body in bodies.items()}}))
"""
"""Prints the states after a number of steps; floats in JSON are exact."""


def test_program_of_a_scene_ends_in_the_state_of_a_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    name, target = write_scene(tmp_path), tmp_path / "game.py"
    out = output_of(capfd, "export", name, "--to", str(target), "--set", "solver.substeps=3")
    lines = len(target.read_text(encoding="utf-8").splitlines())
    assert out == [f"written: {target} ({lines} lines)"]
    trajectory = run(load(name, ["solver.substeps=3"]), "pymunk")
    script = FINAL_STATE.format(steps=len(trajectory.time) - 1)
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    state = [*trajectory.position[-1, 0].tolist(), *trajectory.velocity[-1, 0].tolist()]
    assert json.loads(child.stdout) == {"a": state}


RAMP = """
[[wall]]
name = "ramp"
points = [[-4, 2], [-1, 0.5], [4, 0]]
[[box]]
name = "crate"
position = [-3.5, 2.5]
size = [0.5, 0.5]
"""


def test_bent_wall_is_divided_and_the_program_says_so(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    name, target = write_scene(tmp_path, DROP + RAMP), tmp_path / "game.py"
    written, note = output_of(capfd, "export", name, "--to", str(target))
    assert written.startswith("written: ") and "'ramp'" in note and "divided" in note
    comments = " ".join(line.removeprefix("# ") for line in target.read_text(encoding="utf-8").splitlines())
    assert note.removeprefix("note: ") in comments
    scene, _ = with_divided_walls(load(name))
    trajectory = run(scene, "pymunk")
    script = FINAL_STATE.format(steps=len(trajectory.time) - 1)
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    for body, state in json.loads(child.stdout).items():
        k = scene.bodies.number_of[body]
        assert state == [*trajectory.position[-1, k].tolist(), *trajectory.velocity[-1, k].tolist()]
    status, document, _ = json_of(capfd, "export", name, "--to", str(target), "--force")
    assert (status, document["files"][0]["divided_walls"]) == (0, ["ramp"])


def test_refusal_names_walls_as_in_the_file(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    ramp = RAMP.replace('name = "ramp"', 'name = "ramp"\none_way = true')
    name = write_scene(tmp_path, DROP + ramp)
    status, out, err = lines_of(capfd, "export", name, "--to", str(tmp_path / "game.py"))
    assert (status, out, len(err)) == (2, [], 1)
    assert err[0].endswith("one-way walls need callbacks with a memory: 'ramp'")


def test_warnings_of_check_are_comments(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "game.py"
    assert call(["check", "fast_ball", "--engine", "pymunk", "--json"]) == 0
    warnings = json.loads(capfd.readouterr().out)["warnings"]
    assert warnings
    assert call(["export", "fast_ball", "--to", str(target), "--quiet"]) == 0
    comments = " ".join(line.removeprefix("# ") for line in target.read_text(encoding="utf-8").splitlines())
    assert all(warning["message"] in comments for warning in warnings)


def test_refusal_names_all_reasons_and_writes_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    name = write_scene(tmp_path, DROP.replace("[world]", "[world]\nlinear_drag = 0.1") + ZONE)
    target = tmp_path / "game.py"
    status, document, err = json_of(capfd, "export", name, "--to", str(target))
    assert status == 2
    assert [fault["path"] for fault in document["faults"]] == ["world.linear_drag", "zone"]
    assert all(line.startswith(f"{name}: ") for line in err)
    assert not target.exists()


def test_existing_program_is_replaced_only_with_force(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    name, target = write_scene(tmp_path), tmp_path / "game.py"
    target.write_text("mine\n", encoding="utf-8")
    status, _, err = lines_of(capfd, "export", name, "--to", str(target))
    assert status == 2
    assert "--force" in err[0]
    assert target.read_text(encoding="utf-8") == "mine\n"
    assert call(["export", name, "--to", str(target), "--force", "--quiet"]) == 0
    assert "def make_space" in target.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "at_fault"),
    [
        (("--to", "game.py", "--to", "run.csv"), ["--to"]),
        (("--to", "game.py", "--fps", "3", "--until", "1"), ["--fps", "--until"]),
        (("--to", "game.py", "--runs"), ["--runs", "--runs"]),
        (("--to", "run.csv", "--force", "--set", "solver.dt=1"), ["--force", "--set"]),
        (("--to", "missing/game.py"), ["--to"]),
        (("--to", "game.py", "--set", "solver.dtt=1"), ["drop.toml"]),
    ],
)
def test_faults_of_the_command_line(options, at_fault, tmp_path, monkeypatch, capfd):
    write_scene(tmp_path)
    monkeypatch.chdir(tmp_path)
    status, out, err = lines_of(capfd, "export", "drop.toml", *options)
    assert (status, out) == (2, [])
    named = sorted(line.partition(":")[0] for line in err)
    assert set(at_fault) <= set(named)
    assert not Path("game.py").exists()


@pytest.mark.parametrize("source", ["nothing", "session.json", "."])
def test_source_that_is_no_scene_is_a_fault(source, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    Path("session.json").write_text("{}", encoding="utf-8")
    status, _, err = lines_of(capfd, "export", source, "--to", "game.py")
    assert status == 2
    assert len(err) == 1
    assert err[0].startswith(f"{source}: ")
