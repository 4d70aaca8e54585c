"""`sandbox compare --minimise`: the written scene, output, faults before any run, interrupt."""

from pathlib import Path

import pytest

from sandbox.cli import minimise as minimising
from sandbox.cli.main import call
from sandbox.measure.compare.reduce import ReducedScene, minimise
from sandbox.progress import Progress
from sandbox.scene.files.load import load
from tests.cli.calling import document_of, json_of, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

TUNNEL = """
title = "Tunnel"
[world]
duration = 0.02
[solver]
dt = 0.001
[[plane]]
point = [0.0, -50.0]
normal = [0.0, 1.0]
[[wall]]
name = "thin"
points = [[1.0, -1.0], [1.0, 1.0]]
thickness = 0.02
[[grid]]
origin = [-5.0, 4.0]
columns = 3
spacing = [0.5, 0.5]
radius = 0.1
[[ball]]
name = "bullet"
position = [0.05, 0.0]
velocity = [100.0, 0.0]
radius = 0.01
"""
CHOICE = ("--engines", "pymunk,exact", "--minimise")


@pytest.fixture(autouse=True)
def in_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_minimised_scene_is_written_to_the_working_folder_and_reproduces(tmp_path, capfd):
    folder = tmp_path / "scenes"
    folder.mkdir()
    scene = write_scene(folder, TUNNEL, "tunnel.toml")
    out = output_of(capfd, "compare", scene, *CHOICE)
    assert out[-3].startswith("minimised: 4 bodies to 1, 2 fixed objects to 1, in ")
    difference = 'pymunk and exact differ by more than 0.0001 m from t = 0.01 s on, "bullet" first'
    assert out[-2:] == [difference, "written: tunnel.min.toml"]
    text = Path("tunnel.min.toml").read_text(encoding="utf-8")
    assert text.splitlines()[:3] == [
        f"# {difference}.",
        "# Minimised: 4 bodies to 1, 2 fixed objects to 1, from tunnel.toml.",
        "# Reproduce: sandbox compare tunnel.min.toml --engines pymunk,exact --tolerance 0.0001",
    ]
    minimised = load("tunnel.min.toml")
    assert (minimised.title, minimised.bodies.names, minimised.fixed_names) == (
        "Tunnel, minimised",
        ("bullet",),
        ("thin",),
    )
    again = text.splitlines()[2].split("sandbox ")[1].split()
    status, document, _ = json_of(capfd, *again)
    assert status == 0
    assert [row["first_divergence"] for row in document["engines"]] == [0.01, None]


@pytest.mark.parametrize("engines", ["pymunk,exact", "exact", "pymunk,reference,exact"])
def test_engines_that_agree_leave_nothing_to_minimise(engines, tmp_path, capfd):
    scene = write_scene(tmp_path, TUNNEL.replace("[100.0", "[1.0"), "slow.toml")
    status, document, err = json_of(capfd, "compare", scene, "--engines", engines, "--minimise")
    assert status == 1
    assert err[-1] == f"{scene}: nothing to minimise: {document['minimised']['error']}"
    assert (document["minimised"]["path"], document["minimised"]["bodies_after"]) == (None, 4)
    assert not Path("slow.min.toml").exists()


def test_unwritable_target_is_refused_before_any_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, TUNNEL, "tunnel.toml")
    Path("old.toml").write_text("kept", encoding="utf-8")
    for file, reason in (
        ("old.toml", "exists already"),
        ("tunnel.toml", "is the scene itself"),
        (".", "is a folder"),
        ("nowhere/small.toml", "no such folder"),
    ):
        status, out, err = lines_of(capfd, "compare", scene, *CHOICE, file)
        assert (status, out, len(err)) == (2, [], 1)
        assert err[0].startswith(f"--minimise: {file}: {reason}")
    assert Path("old.toml").read_text(encoding="utf-8") == "kept"
    assert lines_of(capfd, "compare", scene, "--force")[0] == 2
    assert lines_of(capfd, "compare", scene, *CHOICE, "old.toml", "--force", "--quiet") == (0, [], [])
    assert load("old.toml").bodies.names == ("bullet",)


def test_interrupted_minimise_writes_the_smallest_scene_so_far(tmp_path, capfd, monkeypatch):
    def interrupted(*arguments: object, **options: object) -> ReducedScene:
        count = 0

        def interrupt_at_sixth_call(_: Progress) -> None:
            nonlocal count
            count += 1
            if count == 6:
                raise KeyboardInterrupt

        return minimise(*arguments, **{**options, "on_progress": interrupt_at_sixth_call})

    monkeypatch.setattr(minimising, "minimise", interrupted)
    scene = write_scene(tmp_path, TUNNEL, "tunnel.toml")
    status = call(["compare", scene, *CHOICE, "--json"])
    out, err = capfd.readouterr()
    assert status == 130
    assert document_of(out)["minimised"]["error"] == "interrupted"
    assert err.splitlines()[-1] == "interrupted: a smaller scene may exist"
    assert len(load("tunnel.min.toml").bodies) < 4
