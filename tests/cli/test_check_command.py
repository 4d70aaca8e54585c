"""`sandbox check`: faults, demands, engines, warnings."""

import re
from pathlib import Path

import pytest

from sandbox.cli import check
from sandbox.engines.registry import ENGINES
from sandbox.measure.preflight import FAILED, Diagnostic
from sandbox.measure.preflight.checks import CHECKS, Check
from sandbox.measure.run.runner import run
from sandbox.scene.compile.demands import JOINT_LIMITS, JOINTS, Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from tests.cli.calling import DROP, FAULTY, document_from, json_of, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def test_json_of_a_valid_scene_has_every_key(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    document = document_from(capfd, "check", scene)
    assert {"scene", "title", "ok", "faults", "demands", "engines", "warnings", "notes"} <= set(document)
    assert (document["scene"], document["title"], document["ok"]) == (scene, "Drop", True)
    assert (document["faults"], document["warnings"], document["notes"]) == ([], [], [])
    assert sorted(document["demands"]) == ["ball-plane", "gravity", "restitution", "translation"]
    assert document["engines"] == {name: {"ok": True, "missing": []} for name in ENGINES}


def test_json_of_a_faulty_scene_has_every_fault_with_line_and_path(tmp_path, capfd):
    scene = write_scene(tmp_path, FAULTY)
    status, document, err = json_of(capfd, "check", scene)
    assert (status, err) == (2, [])
    assert (document["scene"], document["title"], document["ok"]) == (scene, None, False)
    assert (document["demands"], document["engines"], document["warnings"]) == ([], {}, [])
    assert all(set(fault) == {"file", "line", "path", "message"} for fault in document["faults"])
    faults = [(fault["file"], fault["line"], fault["path"]) for fault in document["faults"]]
    assert faults == [(scene, 3, "ball.a.position"), (scene, 4, "ball.a.radius")]
    status, out, lines = lines_of(capfd, "check", scene)
    assert (status, out) == (2, [])
    assert lines == [f"{scene}:{f['line']}: {f['path']}: {f['message']}" for f in document["faults"]]


def test_status_of_several_scenes_is_that_of_the_worst(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    good, bad = write_scene(tmp_path), write_scene(tmp_path, FAULTY, "bad.toml")
    status, document, _ = json_of(capfd, "check", good, bad, "nowhere")
    assert (status, list(document)) == (2, ["scenes"])
    assert [(each["scene"], each["ok"]) for each in document["scenes"]] == [
        (good, True),
        (bad, False),
        ("nowhere", False),
    ]
    status, document, _ = json_of(capfd, "check", good, good)
    assert (status, len(document["scenes"])) == (0, 2)


def test_scene_that_no_engine_can_run_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, document, _ = json_of(capfd, "check", scene, "--set", "solver.detection=penalty_is_none")
    assert (status, document["ok"]) == (2, False)
    status, document, _ = json_of(capfd, "check", scene, "--set", "solver.broad_phase=oriented")
    assert (status, document["ok"], document["faults"]) == (1, True, [])
    assert list(document["engines"]) == list(ENGINES)
    for verdict in document["engines"].values():
        (reason,) = verdict["missing"]
        assert not verdict["ok"]
        assert reason.startswith("broad_phase 'oriented' ")


def test_warning_has_kind_message_and_odds(capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "check", "bullet")
    (warning,) = document["warnings"]
    assert warning["kind"] == "tunnelling"
    assert warning["odds"] == pytest.approx(0.8, abs=1e-12)  # 1 − 0.02/(100·0.001), to rounding
    assert "undetected: odds up to 80 %; occurs in " in warning["message"]
    assert (warning["seen"]["engine"], warning["seen"]["until"]) == ("pymunk", None)
    assert warning["seen"]["starts"]["probability"] == pytest.approx(
        0.8, abs=2 / 30
    )  # the phases divide the step evenly
    (remedy,) = warning["remedies"]
    assert (remedy["name"], remedy["starts"]["hits"]) == ("dt", 0)
    assert f"with solver.dt = {remedy['value']:g} in none of 30 starts" in warning["message"]
    assert document["safe_dt"] == pytest.approx(0.0002, rel=1e-12)  # rounding of a quotient
    _, document, _ = json_of(capfd, "check", "bullet", "--set", "solver.dt=0.0001")
    assert document["warnings"] == []


def test_scene_without_possible_tunnelling_has_no_safe_dt(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "check", "tutorial/fireworks")
    assert document["safe_dt"] is None
    slow = write_scene(tmp_path, DROP.replace("[0.0, -10.0]", "[0.0, 0.0]") + "velocity = [0.0, 1e-320]\n")
    status, document, err = json_of(capfd, "check", slow)  # quotients by this speed overflow
    assert (status, document["safe_dt"], err) == (0, None, [])


def test_demands_and_engines_are_printed_one_per_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    status, out, err = lines_of(capfd, "check", scene, "-v")
    assert (status, out[0], err) == (0, f"{scene}: Drop", [])
    # all kinds of joints are one line if the scene has none
    engines_begin = 2 + len(Demand) - len(JOINTS | JOINT_LIMITS) + 1
    marks = {line.split()[1]: line.split()[0] for line in out[1:engines_begin]}
    assert (marks["gravity"], marks["drag"], marks["rotation"]) == ("on", "off", "off")
    assert out[engines_begin : engines_begin + len(ENGINES)] == [
        f"  engine {name}: models everything in the scene" for name in ENGINES
    ]
    assert len(out) == engines_begin + 1 + len(ENGINES)


def test_warnings_come_first_and_physics_that_is_not_needed_is_counted(capfd: pytest.CaptureFixture[str]) -> None:
    _, all_lines, _ = lines_of(capfd, "check", "bullet", "--no-trial", "-v")
    _, out, _ = lines_of(capfd, "check", "bullet", "--no-trial")
    off = [line for line in all_lines if line.startswith("  off")]
    assert len(off) > 1
    assert out[1].startswith("  warning: ")
    assert [line for line in out if line.startswith("  off")] == [f"  off  {len(off)} others, which -v lists"]
    # the columns are as wide as their longest cell
    on = [line.split() for line in all_lines if line not in off]
    assert [line.split() for line in out if not line.startswith("  off")] == on


def test_quiet_prints_only_warnings_and_faults(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert lines_of(capfd, "check", write_scene(tmp_path), "--quiet") == (0, [], [])
    status, out, err = lines_of(capfd, "check", "bullet", "--quiet")
    assert (status, len(out), err) == (0, 1, [])
    assert out[0].startswith("bullet: warning: 'bullet' can approach 'wall' at up to 100 m/s, 0.1 m per substep")


def test_trial_run_names_the_balls_that_pass_through(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = '[world]\nduration = 1.0\n[[wall]]\nname = "w"\npoints = [[1, -9], [1, 9]]\nthickness = 0.02\n'
    for k, (name, speed) in enumerate((("slow", 9.0), ("middle", 25.0), ("fast", 60.0))):
        text += f'[[ball]]\nname = "{name}"\nposition = [0, {k}]\nvelocity = [{speed}, 0]\nradius = 0.1\n'
    _, document, _ = json_of(capfd, "check", write_scene(tmp_path, text), "--starts", "1")
    covered = {"engine": "pymunk", "duration": 1.0, "whole": True, "starts": 1, "spread": 0.01}
    assert document["trial"] == {**covered, "asked": 1, "limited_by": None}
    passed = [(w["ball"], w["thing"]) for w in document["warnings"] if w.get("seen", {}).get("starts", {}).get("hits")]
    result = run(load(write_scene(tmp_path, text)))
    assert passed == [(result.names[a], "w") for a, _ in result.missed_pair.tolist()]
    assert len(passed) > 0


def test_fast_ball_has_a_depth_warning_unless_bisected(capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "check", "tutorial/fast_ball")
    (warning,) = document["warnings"]
    assert (warning["kind"], warning["ball"], warning["thing"], warning["speed"]) == ("depth", "ball", "ground", 100.0)
    assert warning["safe_dt"] == pytest.approx(0.005, rel=1e-12)  # rounding of a quotient
    bisecting = ("--set", "solver.detection=bisect", "--set", "solver.integrator=velocity_verlet")
    _, document, _ = json_of(capfd, "check", "tutorial/fast_ball", *bisecting)
    assert document["warnings"] == []


def test_scene_in_pixels_has_a_note(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pixels = "[world]\ngravity = [0, 981]\n[[ball]]\nposition = [100, 100]\nradius = 20\n"
    _, document, _ = json_of(capfd, "check", write_scene(tmp_path, pixels))
    assert [note["kind"] for note in document["notes"]] == ["pixels"]
    metres = pixels.replace("981", "-9.81").replace("20", "0.2")
    _, document, _ = json_of(capfd, "check", write_scene(tmp_path, metres, "metres.toml"))
    assert document["notes"] == []


def test_substeps_of_a_preset_are_shown(capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "check", "9-ball")
    assert document["step"] == {"dt": 0.01, "substeps": 10}
    _, out, _ = lines_of(capfd, "check", "9-ball")
    assert any("dt is 0.01 s with 10 substeps, so a step takes 0.001 s" in line for line in out)


def test_safe_dt_is_unknown_if_the_speed_is_unbounded(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = DROP + "[[attraction]]\ntoward = [3, 3]\nstrength = 1.0\n"
    _, document, _ = json_of(capfd, "check", write_scene(tmp_path, text))
    assert (document["safe_dt"], document["safe_dt_known"]) == (None, False)
    _, out, _ = lines_of(capfd, "check", write_scene(tmp_path, text))
    assert any("unknown, because attraction without softening" in line for line in out)


def test_trial_run_uses_the_chosen_engine(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    for engine in ("pymunk", "reference"):
        _, document, _ = json_of(capfd, "check", scene, "--engine", engine)
        assert document["trial"]["engine"] == engine
    _, document, _ = json_of(capfd, "check", scene, "--no-trial")
    assert document["trial"] is None
    status, _, err = lines_of(capfd, "check", scene, "--engine", "none")
    assert (status, len(err)) == (2, 1)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("ball", "--starts", "20"), r"trial runs on pymunk, from 20 starts: "),
        (("ball", "--starts", "10000"), r"trial runs on pymunk, from \d+ of 10,000 starts, as more would exceed the "),
        (("pendulum_90", "--spread", "0%"), r"one trial run on pymunk, from 1 of 30 starts, as no start differs from "),
        (("pendulum_90", "--starts", "1"), r"one trial run on pymunk$"),
    ],
)
def test_first_line_says_how_many_starts_ran_of_how_many(capfd, words, text):
    status, out, _ = lines_of(capfd, "check", *words)
    assert status == 0
    assert re.match(text, out[1].strip())


def test_failure_in_one_scene_does_not_affect_other_scenes(tmp_path, capfd, monkeypatch):
    good, bad = write_scene(tmp_path), write_scene(tmp_path, DROP.replace("Drop", "Bad"), "bad.toml")
    original = check.bill

    def broken(scene: Scene) -> object:
        if scene.title == "Bad":
            raise OverflowError("math range error")
        return original(scene)

    monkeypatch.setattr(check, "bill", broken)
    status, document, err = json_of(capfd, "check", bad, good)
    assert (status, [each["ok"] for each in document["scenes"]]) == (1, [False, True])
    assert "OverflowError: math range error" in document["scenes"][0]["faults"][0]["message"]
    assert len(err) == 1


def test_failure_of_one_check_does_not_affect_other_checks(capfd, monkeypatch):
    def broken(situation: object) -> list[Diagnostic]:
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setitem(CHECKS, "springs", Check(broken))
    status, document, _ = json_of(capfd, "check", "bullet")
    assert (status, [w["kind"] for w in document["warnings"]]) == (1, ["tunnelling", FAILED])
    assert document["warnings"][1]["forecast"] == "springs"


def test_expand_prints_only_the_expanded_scene(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    preset = write_scene(tmp_path, '[billiards]\ntable = "pool-9ft"\ngame = "9-ball"\n')
    out = output_of(capfd, "check", "--expand", preset, "--set", "ball.cue.velocity=[1,0]")
    scene = loads("\n".join(out))
    assert scene == load(preset, ["ball.cue.velocity=[1,0]"])
    assert scene.billiards is None
    assert (len(scene.balls), scene.balls[0].velocity) == (10, (1.0, 0.0))


def test_expand_requires_one_valid_scene(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    faulty, valid = write_scene(tmp_path, FAULTY), write_scene(tmp_path, DROP, "valid.toml")
    status, out, err = lines_of(capfd, "check", "--expand", faulty)
    assert (status, out, len(err)) == (2, [], 2)
    for arguments in ((faulty, valid), (valid, "--json")):
        status, out, err = lines_of(capfd, "check", "--expand", *arguments)
        assert (status, out) == (2, [])
        assert "--expand prints one scene" in "\n".join(err)
