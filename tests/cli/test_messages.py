"""Messages for wrong input: exit status, and one line with location and correction; nothing is printed or written."""

import json
import shlex
from pathlib import Path

import pytest

from tests.cli.calling import DROP, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # modules of all commands are imported

SLINGSHOT = "[pinball]\n[[pinball.slingshot]]\npoints = [[0.0, 0.0], [0.1, 0.0]]\n"
BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"

WRONG = """
rum bounce → unknown command 'rum'; did you mean 'run'?
bounce → use `sandbox run bounce` or `sandbox play bounce`
xyzzy → commands: run, runs, play,
--nonsense → --nonsense
run → SCENES
run bounce --nonsense → --nonsense
run bounce --out → --out
run bounce --seeds x → 'x'
run bounce --seeds 0 → --seeds
scenes bounce → bounce
run bounce --set dt=0.01 → dt (set): unknown key; did you mean solver.dt?
run bounce --set gravity=[0,1] → did you mean world.gravity?
run bounce --set ball.radius=1 → ball.*.radius for all
run double_pendulum --set joint.length=3 → joint.upper rod.length
run bounce --set scatter.count=3 → scatter.count: the scene has no [[scatter]]
run bounce --set ball.bal.radius=1 → did you mean 'ball'?
run bounce --set ground.restitution=1 → plane.ground.restitution
run bounce --set wrold.bounds.x.y=1 → did you mean world.bounds.x.y?
run bounce --set radius=1 → it is a key of [[ball]]
run bounce --set ball.ball.velocity.0=3 → ball.ball.velocity=…
run bounce --set solver.engine=box3d → the engine is not part of a scene
run bounce --set solver.dt → bounce.toml: --set:
run bounce --set =3 → bounce.toml: --set:
run bounce --set solver=3 → bounce.toml: solver (set)
run bounce --set ball.ball.radius=-1 → ball.ball.radius (set): must be greater than 0, is -1
run bounce --set ball.ball.mass=0 → ball.ball.mass (set): must be greater than 0, is 0
run bounce --set ball.ball.restitution=1.2 → must be between 0 and 1, is 1.2
run bounce --set solver.dt=0 → must be greater than 0 and at most 10, is 0
run bounce --set solver.substeps=2.5 → must be a whole number, is 2.5
run bounce --set solver.substeps=3.0 → must be a whole number, is 3.0
run bounce --set ball.ball.position=[1] → must be an array of 2, has 1
run bounce --set solver.dt=0.1 --sweep solver.dt=0.1,0.2 → --sweep: solver.dt:
run bounce --sweep solver.dt=1e-3:1e-2 → solver.dt=1e-3:1e-2:N
run bounce --sweep solver.substeps=1:4 → a range needs a count
run bounce --sweep solver.dt=1:2:3:4:5 → LOW:HIGH:N:log
run bounce --sweep solver.dt=1:2:0 → --sweep: 'solver.dt=1:2:0'
run bounce --sample 3 → --sample: needs a range
run bounce --engine none → --engine: unknown engine 'none'; engines:
run bounce --engines pymunk, → --engine: unknown engine ''
run bounce --plot x.gif → --plot: x.gif:
run bounce --plot nowhere/x.png → --plot: nowhere/x.png: no such folder: nowhere
run bounce --plot folder.png → --plot: folder.png: is a folder
run bounce --plot x.png --sweep solver.dt=0.01,0.02 → --plot: draws a single run
run bounce --plot x.png --body bal → did you mean 'ball'?
run bounce --body ball → --body:
run bounce --out drop.toml → --out: drop.toml: is a file
run bounce --player none → --player: has no use
run bounce --on tcp://127.0.0.1:1 --workers 2 → --workers:
run bounce --keep end --engine exact --audit → --audit:
run curling --player none → play.curling.people=0
run duel --player none → would never play
run . → is a folder; it contains no scene (*.toml)
run run.npz → sandbox export
compare tutorial → is a folder; name one of its scenes: tutorial/ball,
compare no_such_scene → no_such_scene
compare drop.toml --tolerance 0 → --tolerance
compare drop.toml --tolerance x → --tolerance
compare drop.toml --set solver.dt=0.1 --sweep solver.dt=0.1,0.2 → --sweep: solver.dt:
compare drop.toml --sweep solver.integratr=rk4 → integratr
compare drop.toml --sweep world.duration=0.1,0.2 --out x → --out
compare drop.toml --sweep solver.dt=0.1,0.2 --minimise → --minimise
compare drop.toml --set world.duration=900000 --set solver.dt=0.001 --engine pymunk → GB
tradeoff drop.toml --tolerance nan → is not finite
tradeoff drop.toml --tolerance -1 → --tolerance
tradeoff drop.toml --budget inf → is not finite
tradeoff drop.toml --budget 0 → --budget
tradeoff drop.toml --fps inf → is not finite
tradeoff drop.toml --zoom nan → is not finite
tradeoff drop.toml --zoom -1 → --zoom
tradeoff drop.toml --time-limit inf → is not finite
tradeoff drop.toml --effort inf → is not finite
tradeoff drop.toml --seeds 0 → --seeds
tradeoff drop.toml --points 0 → --points
tradeoff drop.toml --set world.duration=0.1 --write → --write:
advise drop.toml --tolerance 1 → has no unit
advise drop.toml --tolerance 1pt → units px, m, cm, mm
advise drop.toml --tolerance px → not a number with a unit
advise drop.toml --tolerance -1px → positive
advise drop.toml --tolerance 1e999px → positive and finite
advise drop.toml --budget '4 minutes' → not one of the units
advise drop.toml --budget 0ms → positive
advise drop.toml --fps nan → fps
advise drop.toml --zoom -50 → zoom
advise drop.toml --effort 0 → effort
advise drop.toml --out nowhere/page.html → --out:
advise none.json → none.json
advise run.npz → run.npz
report drop.toml → --out
report drop.toml --out drop.toml/a.html → --out:
report drop.toml --out a.html --effort inf → is not finite
report drop.toml --out a.html --patience inf → is not finite
shots drop.toml → no [[shot]]
shots 9-ball --window '12:upper left pocket' → --window: no ball is named '12'
shots 9-ball --window cue:near → --window: no pocket is named 'near'
shots 9-ball --window cue → --window: 'cue' is not BALL:POCKET
shots 9-ball --shot draw → no shot is named 'draw'
shots 9-ball --aim-error nan → is not finite
shots 9-ball --nudge nan → is not finite
shots 9-ball --out drop.toml → --out: drop.toml: is not a folder
extremes --axes dt --quick --set solver.itterations=3 → itterations
extremes --axes dt --quick --set solver.dt → --set
extremes --axes dt --quick --set solver.dt=0.01 → varies; remove it
extremes --axes speed --timeout 0 → --timeout
extremes --axes speed --timeout nan → --timeout
extremes --axes speed --memory 10 → --memory
extremes --axes speed --workers 0 → --workers
miss duel --speed nan → --speed
miss duel --angle 200 → --angle
match bounce → is not a billiard table
match 9-ball --misses → 9-ball:
match 9-ball --game chess → unknown game 'chess'
match 9-ball --time-limit nan → --time-limit
check drop.toml --engine none → --engine
schema bal → did you mean 'ball'?
schema ball.radius → 'radius' is a value, not a table
schema ball.x → no key 'x'; known keys: name,
replay drop.toml → `sandbox play drop.toml`
play session.json → `sandbox replay session.json`
runs . → sandbox run SCENE --out .
"""
"""Command lines, and a part of the one line of standard error."""


@pytest.mark.parametrize("row", WRONG.strip().splitlines())
def test_wrong_command_line_is_status_2_and_one_line(row, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    arguments, _, part = row.partition(" → ")
    if arguments != "run .":
        write_scene(tmp_path)
    Path("folder.png").mkdir()
    Path("run.npz").write_bytes(b"PK")
    Path("session.json").write_text('{"format": 1, "presses": []}', encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    status, out, err = lines_of(capfd, *shlex.split(arguments))
    assert (status, out, len(err)) == (2, [], 1), err
    assert part in err[0]
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ("run bounce --engine pymunk --set solver.integrator=rk4", "use --engine reference"),
        ("play bounce --set solver.integrator=rk4", "add --engine reference"),
        ("match 8-ball --engine reference --set solver.response=penalty", "response 'penalty'"),
    ],
)
def test_scene_that_the_engine_refuses_is_status_1_and_one_line(arguments, part, capfd):
    status, _, (line,) = lines_of(capfd, *shlex.split(arguments))
    assert status == 1
    assert part in line


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
def test_fault_has_line_path_and_a_correction(text, location, words, tmp_path, capfd):
    scene = write_scene(tmp_path, text)
    status, out, (line,) = lines_of(capfd, "check", scene)
    assert (status, out) == (2, [])
    assert line.startswith(f"{scene}{location}: ")
    assert words in line


@pytest.mark.parametrize("kind", ["run", "compare"])
def test_json_output_of_a_command_is_not_accepted_as_a_session(kind, tmp_path, capfd):
    file = tmp_path / "study.json"
    file.write_text(json.dumps({"runs": []} if kind == "run" else {"scene": "x", "engines": []}))
    status, _, (line,) = lines_of(capfd, "run", str(file))
    assert (status, line) == (2, f"{file}: cannot be read as a session: it is the output of `sandbox {kind} --json`")


def test_folder_is_run_and_checked_scene_by_scene(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path, DROP, "b.toml")
    write_scene(tmp_path, DROP, "a.toml")
    (tmp_path / "pyproject.toml").write_text("[project]\nname = 'x'\n")  # has other tables: not a scene
    (tmp_path / "notes.txt").write_text("no scene")
    for folder in (".", f"{tmp_path}"):
        out = output_of(capfd, "run", folder)
        assert [Path(line.split()[0]).name for line in out[1:]] == ["a.toml", "b.toml"]
    status, out, _ = lines_of(capfd, "check", ".")
    assert status == 0
    assert sum(line.endswith(": Drop") for line in out) == 2


def test_fault_in_a_folder_names_its_file(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path, "x = [", "broken.toml")
    status, _, (line,) = lines_of(capfd, "run", ".")
    assert status == 2
    assert line.startswith("broken.toml:1: not TOML")


def test_message_for_a_folder_of_many_runs_names_three_and_the_table(tmp_path, capfd):
    for k in range(500):
        (tmp_path / f"{k:032x}.npz").touch()
    status, _, (line,) = lines_of(capfd, "export", str(tmp_path), "--to", "x.gif")
    assert status == 2
    assert "contains 500 runs; name one: " in line
    assert line.count(str(tmp_path / "0000")) == 3
    assert f"the table `runs` of {tmp_path / 'runs.sqlite'} lists all" in line
