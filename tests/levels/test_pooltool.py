"""Import of saved shots of pooltool: their physics, their values, and hostile files."""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.cli.main import call
from sandbox.levels import ImportedLevel, import_pooltool
from sandbox.scene.description.surface import struck
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import MAX_DEPTH
from tests.levels.pooltool_shots import CAROM, NOSE, POOL, ball, document, text_of

ROUNDING = 1e-12
"""of velocities and spins, relative"""


def imported(*balls: dict[str, Any], **changes: Any) -> ImportedLevel:
    """Import a shot with changes of its cue."""
    return import_pooltool(text_of(document(*balls, **changes)))


def faults_of(shot: dict[str, Any]) -> tuple[Fault, ...]:
    """Return the faults of a shot."""
    with pytest.raises(SceneError) as caught:
        import_pooltool(text_of(shot))
    return caught.value.faults


def started(level: ImportedLevel) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity, m/s, and spin, rad/s, of the first ball directly after the stroke."""
    scene = level.scene
    if scene.shots:
        velocity, spin = struck(scene.shots[0], scene.balls[0].mass or 1.0, scene.balls[0].radius)
    else:
        velocity, spin = scene.balls[0].velocity, scene.balls[0].spin or (0.0, 0.0, 0.0)
    return np.array(velocity), np.array(spin)


RECORDED = {
    "side": (
        {"phi": 94.0, "a": -0.3},
        [-0.1793795377542306, 1.9590245720644102],
        [0.0, 0.0, 51.63306929256247],
        0.26901455570475613,
        [0.4535178141601028, 1.4469080592116743],
    ),
    "elevated": (
        {"phi": 94.0, "theta": 25.0, "a": -0.3, "b": -0.2},
        [-0.152568542594502, 1.6662186089262345],
        [30.796579522427667, 22.68175044665575, 43.915723221677226],
        0.3236501378708494,
        [0.47674706517833987, 1.4318452952139855],
    ),
}
"""Shots of pooltool 0.6.0 at 1.5 m/s from (0.4953, 0.9906): the cue, velocity and spin after the stroke, and a later
time and position before the first collision."""
RECORDED_CAROM = (
    {"V0": 3.0, "phi": 82.0, "a": 0.2}, [0.6168200674933491, 4.03371619815772], [0.0, 0.0, -66.35129323585427],
    0.3636815065827047, [0.7047129881771683, 2.0387276774882443],
)  # fmt: skip
"""The same at 3 m/s from (0.5, 0.7), with a ball of carom, of whose mass the cue's end is not a thirtieth."""


@pytest.mark.fail_slow(60)  # compiles kernels of tables
@pytest.mark.parametrize("engine", ["exact", "reference"])
@pytest.mark.parametrize("case", ["side", "elevated", "carom"])
def test_shot_moves_as_recorded_by_pooltool(case: str, engine: str) -> None:
    changes, velocity, spin, time, position = RECORDED_CAROM if case == "carom" else RECORDED[case]
    start = ball("cue", 0.5, 0.7, CAROM) if case == "carom" else ball("cue", 0.4953, 0.9906)
    level = imported(start, **changes)
    got_velocity, got_spin = started(level)
    assert got_velocity == pytest.approx(velocity, rel=ROUNDING)
    assert got_spin == pytest.approx(spin, rel=ROUNDING, abs=1e-12)
    scene = sandbox.loads(level.text, overrides=[f"world.duration={time!r}", f"solver.dt={time / 10!r}"])
    trajectory = sandbox.run(scene, engine)
    assert trajectory.status == "ok"
    assert trajectory.position[-1, 0] == pytest.approx(position, abs=1e-12)  # m; measured 1e-14


offsets = st.floats(-0.7, 0.7)


@given(offsets, offsets, st.floats(0.0, 360.0), st.floats(0.0, 80.0), st.floats(0.002, 0.02))
def test_energy_and_direction_of_a_stroke(a: float, b: float, phi: float, theta: float, end_mass: float) -> None:
    # The impulse J acts at a distance q R from the centre: v = J/m, R ω = 2.5 q v. Only v_z is lost to the floor.
    level = imported(phi=phi, theta=theta, a=a, b=b, specs={"M": 0.567, "end_mass": end_mass})
    velocity, spin = started(level)
    speed = np.hypot(*velocity) / math.cos(math.radians(theta))
    assert np.linalg.norm(spin) * POOL["R"] == pytest.approx(2.5 * math.hypot(a, b) * speed, rel=1e-9, abs=1e-12)
    assert speed == pytest.approx(3.0 / (1.0 + POOL["m"] / 0.567 + 2.5 * (a * a + b * b)), rel=1e-9)
    level_a = 1.0 - a * a
    squirt = math.atan(2.5 * a * math.sqrt(level_a) / (1.0 + POOL["m"] / end_mass + 2.5 * level_a))
    turned = math.atan2(velocity[1], velocity[0]) - (math.radians(phi) - squirt)
    assert math.remainder(turned, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_stroke_table_and_friction_become_tables_of_the_scene() -> None:
    shot = document(phi=60.0, a=0.2, b=0.1)
    segments, pockets = shot["table"]["cushion_segments"], shot["table"]["pockets"]
    segments["circular"]["1t"] = {"id": "1t", "center": [-0.02, 0.09, NOSE], "radius": 0.02}
    pockets["lb"] = {"id": "lb", "center": [-0.03, -0.03, 0.0], "radius": 0.062, "depth": 0.08, "contains": []}
    level = import_pooltool(text_of(shot))
    scene = level.scene
    assert dict(level.counts) == {"wall": 4, "post": 1, "pocket": 1, "ball": 2, "shot": 1}
    (stroke,) = scene.shots
    assert (stroke.ball, stroke.speed, stroke.side, stroke.height) == ("cue", 1.5, -0.2, 0.1)
    assert (stroke.aim, stroke.cue_mass) == (pytest.approx(math.pi / 3, rel=1e-15), 0.567)
    assert (scene.surface.sliding_friction, scene.surface.rolling_friction, scene.surface.gravity) == (0.2, 0.01, 9.81)
    assert scene.surface.spinning_friction == pytest.approx(POOL["R"] * 4 / 9, rel=1e-15)
    assert scene.walls[0].points == ((0.0, 0.0), (0.0, 2.84))
    assert {wall.height for wall in scene.walls} == {scene.posts[0].height} == {NOSE}
    assert (scene.posts[0].position, scene.pockets[0].radius) == ((-0.02, 0.09), 0.062)
    assert scene.play.area == ((0.0, 0.0), (1.42, 2.84))
    assert [(each.position, each.colour) for each in scene.balls] == [((0.5, 0.7), "#f4f1e6"), ((0.5, 1.7), "#f0c020")]
    assert sandbox.loads(level.text) == scene


def test_balls_begin_in_the_first_recorded_state() -> None:
    shot = document()
    cue_ball = shot["balls"]["cue"]
    cue_ball["history"]["states"] = [copy.deepcopy(cue_ball["state"])]
    cue_ball["state"] = {"rvw": [[9.0, 9.0, -0.08], [0.0] * 3, [0.0] * 3], "s": 4, "t": 21.5}
    shot |= {"t": 21.5, "events": [{"event_type": "none", "time": 0.0}]}
    level = import_pooltool(text_of(shot))
    assert level.scene.balls[0].position == (0.5, 0.7)
    assert level.scene.world.duration == 22.0
    assert "events" in [warning.path for warning in level.warnings]


def test_moving_balls_are_not_struck() -> None:
    moving = ball("cue", 0.5, 0.7)
    moving["state"]["rvw"][1:] = [[0.3, 0.4, 0.0], [1.0, 2.0, 3.0]]
    level = imported(moving)
    assert level.scene.shots == ()
    assert (level.scene.balls[0].velocity, level.scene.balls[0].spin) == ((0.3, 0.4), (1.0, 2.0, 3.0))
    assert "cue" in [warning.path for warning in level.warnings]


@pytest.mark.parametrize(
    ("keys", "value", "path"),
    [
        (("balls", "1", "params", "u_s"), 0.3, "balls.1.params.u_s"),
        (("balls", "1", "params", "stickiness"), 0.3, "balls.1.params"),
        (("balls", "1", "state", "rvw"), [[0.5, 1.7, 0.1], [0, 0, 1], [0, 0, 0]], "balls.1"),
        (("balls", "cue", "state", "s"), 4, "cue"),
        (("cue", "theta"), 10.0, "cue"),
        (("cue", "a"), 0.6, "cue"),
        (("cue", "specs", "end_mass"), 0.01, "cue.specs.end_mass"),
    ],
)
def test_parts_that_a_scene_cannot_have_are_named(keys: tuple[str, ...], value: Any, path: str) -> None:
    shot = document(a=0.2)
    plain = {warning.path for warning in import_pooltool(text_of(shot)).warnings}
    assert plain == {""}
    node = shot
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = value
    assert path in {warning.path for warning in import_pooltool(text_of(shot)).warnings}


@pytest.mark.parametrize(
    ("keys", "value", "path"),
    [
        (("cue", "V0"), True, "cue.V0"),
        (("cue", "V0"), math.nan, "cue.V0"),
        (("cue", "a"), 0.9, "cue"),  # with b = 0.9
        (("cue", "cue_ball_id"), "white", "cue.cue_ball_id"),
        (("cue", "specs", "end_mass"), None, "cue.specs"),
        (("balls",), [], "balls"),
        (("balls", "1", "params", "m"), 0, "balls.1.params.m"),
        (("balls", "1", "params", "e_b"), 1.5, "balls.1.params.e_b"),
        (("balls", "1", "state", "rvw"), [[math.nan, 0, 0]] * 3, "balls.1.state.rvw[0][0]"),
        (("balls", "1", "history", "states"), [None], "balls.1.history.states[0]"),
        (("balls", "1\nx"), {}, "balls"),
        (("table", "pockets"), {"a.b": {"center": 1, "radius": 1}}, 'table.pockets."a.b".center'),
        (("table", "cushion_segments", "linear", "3", "p2"), [0, 0, 1], "table.cushion_segments.linear.3.p2"),
        (("table", "cushion_segments", "linear", "3", "p1"), [0, 2.84, NOSE], "table.cushion_segments.linear.3"),
        (("table", "cushion_segments", "circular"), None, "table.cushion_segments.circular"),
        (("t",), -1, "t"),
    ],
)
def test_invalid_values_are_named_by_their_path(keys: tuple[str, ...], value: Any, path: str) -> None:
    shot = document(b=0.9 if keys == ("cue", "a") else 0.0)
    node = shot
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = value
    fault = faults_of(shot)[0]
    assert (fault.file, fault.path.split(".points")[0]) == ("<shot>", path)
    assert len(str(fault).splitlines()) == 1


def test_every_missing_key_is_a_fault_or_has_no_effect() -> None:
    def paths(node: Any, before: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
        if not isinstance(node, dict):
            return []
        return [each for key, value in node.items() for each in ((*before, key), *paths(value, (*before, key)))]

    for keys in paths(document()):
        shot = document()
        node = shot
        for key in keys[:-1]:
            node = node[key]
        del node[keys[-1]]
        try:
            level = import_pooltool(text_of(shot))
        except SceneError as error:
            assert len(error.faults) >= 1
        else:
            assert level.scene.balls


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "well-formed"), (b"\xff\xfe", "UTF-8"), (b"{}", "no `cue`"), (b'{"multisystem": []}', "several shots"),
        (b'{"tilewidth": 16}', ".tmx"), (b'{"scene": {}, "actions": []}', "sandbox run"),
        (b"[" * 100_000, f"{MAX_DEPTH} levels"), (b'{"cue": ' + b"1" * 5000 + b"}", "digits"),
    ],
)  # fmt: skip
def test_file_that_is_no_shot_is_refused(content: bytes, word: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        import_pooltool(path)
    assert word in str(caught.value)
    assert caught.value.faults[0].file == str(path)


def test_sizes_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path in (tmp_path / "none.json", tmp_path, Path("/dev/zero")):
        with pytest.raises(SceneError, match=r"cannot be read|too large"):
            import_pooltool(path)
    shot = document()
    shot["table"]["pockets"] = {str(k): {} for k in range(10_001)}
    assert faults_of(shot)[0].path == "table.pockets"
    monkeypatch.setenv("SANDBOX_MAX_SESSION_SIZE", "1KB")
    (tmp_path / "a.json").write_text(text_of(document()))
    with pytest.raises(SceneError, match="SANDBOX_MAX_SESSION_SIZE"):
        import_pooltool(tmp_path / "a.json")


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_command_writes_a_scene_that_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shot, target = tmp_path / "draw.json", tmp_path / "draw.toml"
    shot.write_text(text_of(document(ball("cue", 0.5, 0.7), ball("1", 0.5, 0.9), b=-0.3)))
    assert call(["import", str(shot), "--to", str(target)]) == 0
    captured = capfd.readouterr()
    assert "2 [[ball]], 1 [[shot]], 1 warning" in captured.out
    assert "collision models" in captured.err
    scene = sandbox.load(target, overrides=["world.duration=2"])
    assert scene.title == "draw"
    trajectory = sandbox.run(scene, "exact")
    y = trajectory.position[:, 0, 1]
    assert y[-1] < y.max() - 0.1  # m: backspin draws the cue ball back from the ball that it hit
    assert call(["import", str(shot), "--json"]) == 0
    printed = json.loads(capfd.readouterr().out)
    assert (printed["scale"], printed["counts"]["shot"]) == (1.0, 1)


@pytest.mark.parametrize(
    "option", [("--scale", "1"), ("--tolerance", "1"), ("--gravity", "0,0"), ("--origin", "centre")]
)
def test_options_of_drawings_are_refused(option, tmp_path, capfd):
    shot = tmp_path / "a.json"
    shot.write_text(text_of(document()))
    assert call(["import", str(shot), *option]) == 2
    assert capfd.readouterr().err.startswith(f"{option[0]}: ")
