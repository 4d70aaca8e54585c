"""Study files: what they run, their faults with lines, and options of the command line beside them."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.batch.study import Study, is_study
from sandbox.scene.errors import SceneError
from tests.cli.calling import DROP, json_of, lines_of, write_scene

STUDY = """
[study]
scenes = ["drop.toml"]
engines = ["pymunk", "reference"]
seeds = 2

[study.set]
"world.duration" = 0.1

[study.sweep]
"solver.dt" = "0.01:0.02:2"
"ball.a.restitution" = [0.2, 0.5]
"""


@pytest.fixture
def study(tmp_path: Path) -> str:
    write_scene(tmp_path, DROP)
    return write_scene(tmp_path, STUDY, "study.toml")


def test_study_is_read_and_its_scenes_are_beside_it(study: str, tmp_path: Path) -> None:
    found = Study.read(study)
    assert found.scenes == (str(tmp_path / "drop.toml"),)
    assert (found.engines, found.seeds, found.sample) == (("pymunk", "reference"), 2, None)
    assert found.overrides == (("world.duration", 0.1),)
    axes, faults = found.axes()
    assert not faults
    assert [(axis.keys, [axis.points[k] for k in range(len(axis.points))]) for axis in axes] == [
        (("solver.dt",), [(0.01,), (0.02,)]),
        (("ball.a.restitution",), [(0.2,), (0.5,)]),
    ]
    assert is_study(study)
    assert not is_study(tmp_path / "drop.toml")
    assert not is_study(tmp_path / "none.toml")


def test_command_line_replaces_what_the_study_says(study: str) -> None:
    given = Study(scenes=(), engines=("exact",), seeds=5, overrides=("solver.dt=0.1",), sweeps=("world.gravity=[0,1]",))
    found = Study.read(study).with_options(given)
    assert (found.engines, found.seeds) == (("exact",), 5)
    assert found.overrides == (("world.duration", 0.1), "solver.dt=0.1")
    assert found.sweeps == (("ball.a.restitution", [0.2, 0.5]), "world.gravity=[0,1]")


def test_sampled_ranges_are_one_axis() -> None:
    study = Study(scenes=("x",), sweeps=("a.b=0:1", "c.d=1,2", "e.f=1:10:log"), sample="8:sobol")
    axes, faults = study.axes()
    assert not faults
    assert [(axis.keys, len(axis.points)) for axis in axes] == [(("c.d",), 2), (("a.b", "e.f"), 8)]


@pytest.mark.parametrize(
    ("sweeps", "sample", "message"),
    [
        (("a.b=1,2",), "8", "needs a range to draw from"),
        (("a.b=0:1",), None, "or --sample N draws from it"),
        (("a.b=0:1",), "x", "a sample is N"),
        ((("a.b", []),), None, "at least one value"),
    ],
)
def test_fault_of_a_sweep_or_sample_is_found(sweeps: tuple[Any, ...], sample: str | None, message: str) -> None:
    _, faults = Study(scenes=("x",), sweeps=sweeps, sample=sample).axes()
    assert message in str(faults[0])


@pytest.mark.parametrize(
    ("text", "line", "path", "message"),
    [
        ("[study]\nscenes = []\n", 2, "study.scenes", "at least 1 item"),
        ("[study]\nseeds = 3\n", 1, "study.scenes", "is missing"),
        ('[study]\nscenes = ["a"]\nseed = 3\n', 3, "study.seed", "unknown key; known keys: scenes, "),
        ('[study]\nscenes = ["a"]\nseeds = 0\n', 3, "study.seeds", "greater than or equal to 1"),
        ('[study]\nscenes = ["a"]\nseeds = 1.5\n', 3, "study.seeds", "must be a valid integer"),
        ('[study]\nscenes = ["a"]\nkeep = "most"\n', 3, "study.keep", "must be 'all', 'summary' or 'end'"),
        ('[study]\nscenes = ["a"]\ntime_limit = 0\n', 3, "study.time_limit", "greater than 0"),
        ("study = 3\n[world]\nx = 1\n", 2, "world", "unknown table"),
        ("study = 3\n", 1, "study", "must be a table"),
        ('[study]\nscenes = ["a"]\n[study.sweep]\n"a.b" = 3\n', 4, "study.sweep.a.b", ""),
        ("[study\n", None, "", "not a study file"),
    ],
)
def test_fault_of_a_study_has_its_line(text: str, line: int | None, path: str, message: str, tmp_path: Path) -> None:
    file = write_scene(tmp_path, text, "study.toml")
    with pytest.raises(SceneError) as caught:
        Study.read(file)
    fault = caught.value.faults[0]
    assert (fault.file, fault.line, fault.path) == (file, line, path)
    assert message in fault.message


@pytest.mark.fail_slow(60)  # takes over half a second
def test_study_runs_as_the_command_that_it_states(study, tmp_path, capfd):
    status, document, err = json_of(capfd, "run", study)
    assert status == 0
    assert len(document["runs"]) == 2 * 2 * 2  # nothing is random, so the seeds are one
    words = ("--engines", "pymunk,reference", "--set", "world.duration=0.1", "--sweep", "solver.dt=0.01,0.02")
    more = ("--sweep", "ball.a.restitution=0.2,0.5", "--seeds", "2")
    _, same, _ = json_of(capfd, "run", str(tmp_path / "drop.toml"), *words, *more)
    assert [run["id"] for run in document["runs"]] == [run["id"] for run in same["runs"]]
    status, _, err = lines_of(capfd, "run", study, str(tmp_path / "drop.toml"))
    assert (status, err) == (2, [f"{study}: give a study file alone: it names its scenes"])
