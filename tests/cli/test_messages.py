"""Messages for common mistakes: one line each, with location and correction, and never a traceback."""

import json
import shlex
from pathlib import Path

import pytest

from tests.cli.calling import DROP, json_of, lines_of, write_scene

SLINGSHOT = "[pinball]\n[[pinball.slingshot]]\npoints = [[0.0, 0.0], [0.1, 0.0]]\n"
BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        # --set and --sweep
        ("run bounce --set dt=0.01", 2, "dt (set): unknown key; did you mean solver.dt?"),
        ("run bounce --set gravity=[0,1]", 2, "did you mean world.gravity?"),
        (
            "run bounce --set ball.radius=1",
            2,
            "name an element, such as ball.ball.radius, or use ball.*.radius for all",
        ),
        (
            "run double_pendulum --set joint.length=3",
            2,
            "such as joint.upper rod.length, or use joint.*.length for all",
        ),
        ("run bounce --set scatter.count=3", 2, "scatter.count: the scene has no [[scatter]]"),
        ("run bounce --set ball.bal.radius=1", 2, "no element 'bal'; did you mean 'ball'?"),
        ("run bounce --set ground.restitution=1", 2, "that is an element: plane.ground.restitution"),
        ("run bounce --set wrold.bounds.x.y=1", 2, "did you mean world.bounds.x.y?"),
        ("run bounce --set radius=1", 2, "it is a key of [[ball]]"),
        ("run bounce --sweep solver.dt=1e-3:1e-2", 2, "a range needs a count: solver.dt=1e-3:1e-2:N"),
        ("run bounce --sweep solver.substeps=1:4", 2, "a range needs a count"),
        ("run bounce --sweep solver.dt=1:2:3:4:5", 2, "a range is LOW:HIGH:N or LOW:HIGH:N:log"),
        ("run bounce --set ball.ball.velocity.0=3", 2, "set all of it, ball.ball.velocity=…"),
        # engines
        (
            "run bounce --engine pymunk --set solver.integrator=rk4",
            1,
            "engines that can: reference; use --engine reference",
        ),
        ("play bounce --set solver.integrator=rk4", 1, "engines that can: reference; add --engine reference"),
        ("match 8-ball --engine reference --set solver.response=penalty", 1, "response 'penalty'"),
        ("run bounce --set solver.engine=box3d", 2, "the engine is not part of a scene"),
        # values
        ("run bounce --set ball.ball.radius=-1", 2, "ball.ball.radius (set): must be greater than 0, is -1"),
        ("run bounce --set ball.ball.mass=0", 2, "ball.ball.mass (set): must be greater than 0, is 0"),
        ("run bounce --set ball.ball.restitution=1.2", 2, "must be between 0 and 1, is 1.2"),
        ("run bounce --set solver.dt=0", 2, "must be greater than 0 and at most 10, is 0"),
        ("run bounce --set solver.substeps=2.5", 2, "must be a whole number, is 2.5"),
        ("run bounce --set ball.ball.position=[1]", 2, "must be an array of 2, has 1"),
        # commands and names
        ("rum bounce", 2, "unknown command 'rum'; did you mean 'run'?"),
        ("bounce", 2, "is a scene, not a command; use `sandbox run bounce` or `sandbox play bounce`"),
        ("xyzzy", 2, "commands: run, runs, play, "),
        ("match bounce", 2, "is not a billiard table"),
        ("run bounce --plot x.png --body bal", 2, "no body is named 'bal'; did you mean 'ball'?"),
        ("compare tutorial", 2, "is a folder; name one of its scenes: tutorial/ball, "),
        ("run .", 2, "is a folder; it contains no scene (*.toml)"),
    ],
)
def test_mistake_is_reported_in_one_line_with_a_correction(
    arguments: str,
    status: int,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    actual, _, err = lines_of(capfd, *shlex.split(arguments))
    assert (actual, len(err)) == (status, 1)
    assert words in err[0]


@pytest.mark.parametrize(
    ("text", "location", "words"),
    [
        (
            "[[pinball.wall]]\npoints = [[0, 0], [1, 1, 1, 1]]\n",
            ":2: pinball.wall[0].points[1]",
            "an array of 2 or 3, is",
        ),
        (SLINGSHOT, ":3: pinball.slingshot[0].points", "must be 3 corners"),
        ('[solver]\nengine = "box3d"\n' + BALL, ":2: solver.engine", "choose it with --engine NAME"),
        ("dt = 0.1\n" + BALL, ":1: dt", "did you mean solver.dt?"),
        ("[world]\nsubsteps = 2\n" + BALL, ":2: world.substeps", "did you mean solver.substeps?"),
    ],
)
def test_fault_has_line_path_and_a_correction(
    text: str, location: str, words: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path, text)
    status, out, (line,) = lines_of(capfd, "check", scene)
    assert (status, out) == (2, [])
    assert line.startswith(f"{scene}{location}: ")
    assert words in line


@pytest.mark.parametrize("kind", ["run", "compare"])
def test_json_output_of_a_command_is_not_accepted_as_a_session(
    kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "study.json"
    file.write_text(json.dumps({"runs": []} if kind == "run" else {"scene": "x", "engines": []}))
    status, _, (line,) = lines_of(capfd, "run", str(file))
    assert (status, line) == (
        2,
        f"{file}: cannot be read as a session: it is the output of `sandbox {kind} --json`",
    )


def test_folder_is_run_and_checked_scene_by_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path, DROP, "b.toml")
    write_scene(tmp_path, DROP, "a.toml")
    (tmp_path / "pyproject.toml").write_text("[project]\nname = 'x'\n")  # has other tables: not a scene
    (tmp_path / "notes.txt").write_text("no scene")
    for folder in (".", f"{tmp_path}"):
        status, out, err = lines_of(capfd, "run", folder)
        assert (status, err) == (0, [])
        assert [Path(line.split()[0]).name for line in out[1:]] == ["a.toml", "b.toml"]
    status, out, _ = lines_of(capfd, "check", ".")
    assert status == 0
    assert sum(line.endswith(": Drop") for line in out) == 2


def test_fault_in_a_folder_names_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path, "x = [", "broken.toml")
    status, _, (line,) = lines_of(capfd, "run", ".")
    assert status == 2
    assert line.startswith("broken.toml:1: not TOML")


def test_json_of_a_run_has_its_overrides(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = ("--set", "ball.a.radius=0.4", "--set", "solver.dt=0.02", "--sweep", "ball.a.mass=1,2")
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), *arguments)
    assert [row["set"] for row in document["runs"]] == [
        {"ball.a.radius": 0.4, "solver.dt": 0.02, "ball.a.mass": mass} for mass in (1, 2)
    ]


@pytest.mark.full
def test_detections_differ_in_their_first_contact(capfd: pytest.CaptureFixture[str]) -> None:
    """The ball reaches the plane at 0.045 s, within the first step of 0.1 s."""
    arguments = ("fast_ball", "--engine", "reference", "--sweep", "solver.detection=discrete,bisect,swept")
    _, document, _ = json_of(capfd, "run", *arguments)
    times = [row["first_contact"] for row in document["runs"]]
    assert times == pytest.approx([0.1, 0.045, 0.045], abs=1e-9)  # bisection stops at 1e-9 of the step
    _, out, _ = lines_of(capfd, "run", *arguments)
    assert "first contact, s" in out[1]
    assert len({line.split("→")[1] for line in out[2:]}) == 2


def test_message_for_a_folder_of_many_runs_names_three_and_the_table(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for k in range(500):
        (tmp_path / f"{k:032x}.npz").touch()
    status, _, (line,) = lines_of(capfd, "export", str(tmp_path), "--to", "x.gif")
    assert status == 2
    assert "contains 500 runs; name one: " in line
    assert line.count(str(tmp_path / "0000")) == 3
    assert f"the table `runs` of {tmp_path / 'runs.sqlite'} lists all" in line
