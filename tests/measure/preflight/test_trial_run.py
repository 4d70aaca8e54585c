"""Trial runs of `check`: remedies that hold, what a trial cannot see, faults of engines that no formula knows."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.measure.preflight import largest_safe_dt, notes, run_preflight
from sandbox.measure.run.runner import run
from sandbox.measure.starts import Starts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # several runs each

DT = 1.0 / 60.0
FLOOR = {"name": "floor", "point": [0.0, 0.0], "normal": [0.0, 1.0]}


def scene_of(gravity: float = -9.81, duration: float = 2.0, **tables: Any) -> Scene:
    tables.setdefault("solver", {"dt": DT})
    return from_document({"world": {"gravity": [0.0, gravity], "duration": duration}, **tables})


def rope(load: float) -> Scene:
    links = 10
    balls = [
        {"name": f"b{k}", "position": [0.0, -0.2 * k], "radius": 0.05, "mass": load if k == links else 1.0}
        for k in range(1, links + 1)
    ]
    joints = [
        {"kind": "rod", "between": [f"b{k - 1}", f"b{k}"] if k > 1 else ["b1"], "length": 0.2}
        for k in range(1, links + 1)
    ]
    joints[0]["anchors"] = [[0.0, 0.0], [0.0, 0.0]]
    return scene_of(ball=balls, joint=joints)


def tower(boxes: int) -> Scene:
    stack = {"base": [0.0, 0.0], "size": [0.2, 0.2], "columns": 1, "rows": boxes, "friction": 0.8}
    return scene_of(duration=5.0, plane=[{**FLOOR, "friction": 0.8}], stack=[stack])


def crushed(ratio: float) -> Scene:
    boxes = [
        {"position": [0.0, 0.25 + 0.5 * k], "size": [0.5, 0.5], "mass": mass, "friction": 0.5}
        for k, mass in enumerate((1.0, ratio))
    ]
    return scene_of(duration=3.0, plane=[{**FLOOR, "friction": 0.5}], box=boxes)


LOADED = [rope(100.0), tower(14), crushed(300.0)]


@pytest.mark.parametrize("scene", LOADED, ids=["rope", "tower", "crushed"])
def test_remedy_is_tried_and_its_outcome_is_that_of_a_run(scene: Scene) -> None:
    found = [each for each in run_preflight(scene, engine="pymunk").warnings if each.tried]
    assert found
    for each in found:
        assert each.tried is not None
        *failed, last = each.tried
        assert not any(remedy.holds for remedy in failed)
        for remedy in each.tried:
            changed = scene.solver.replace(**{remedy.name: type(getattr(scene.solver, remedy.name))(remedy.value)})
            again = run_preflight(scene, changed, "pymunk", starts=remedy.starts.trials).warnings
            kinds = {other.kind for other in again if other.is_observed}
            own = {"chain", "mass_ratio"} if "joint" in each.details else {"stack", "mass_ratio"}
            assert remedy.holds == kinds.isdisjoint(own | {"diverged"})
        assert ("in none of" in each.message or "not with" in each.message) == last.holds


def bullet(speed: float, **wall: Any) -> Scene:
    pane = {"name": "pane", "points": [[1.0, -1.0], [1.0, 1.0]], "thickness": 0.01, **wall}
    ball = {"name": "bullet", "position": [0.0, 0.0], "velocity": [speed, 0.0], "radius": 0.05}
    return scene_of(0.0, 0.3, wall=[pane], ball=[ball])


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("speed", [4.0, 6.0, 12.0, 25.0])
def test_frequency_of_tunnelling_is_that_of_a_random_phase(engine: str, speed: float) -> None:
    """1 − reach/(v·h), with the radius and half the thickness as reach."""
    (found,) = run_preflight(bullet(speed), engine=engine, starts=100).warnings
    assert found.seen is not None
    assert found.seen.starts.trials == 100
    # The phases divide the step evenly, so that only the changes of the speed by 1 % matter.
    assert found.seen.starts.probability == pytest.approx(1.0 - 0.055 / (speed * DT), abs=0.03)


def test_remedy_of_one_bullet_is_not_judged_by_another_one() -> None:
    """The fast bullet still passes with the step that is short enough for the slow one."""
    pane = {"name": "pane", "points": [[1.0, -2.0], [1.0, 2.0]], "thickness": 0.01}
    balls = [
        {"name": name, "position": [0.0, y], "velocity": [speed, 0.0], "radius": 0.05}
        for name, y, speed in (("slow", -1.0, 8.0), ("fast", 1.0, 30.0))
    ]
    scene = scene_of(0.0, 0.3, wall=[pane], ball=balls)
    found = {each.details["ball"]: each for each in run_preflight(scene, engine="pymunk").warnings}
    for name, speed in (("slow", 8.0), ("fast", 30.0)):
        assert found[name].tried is not None
        (remedy,) = found[name].tried
        assert remedy.holds
        assert 0.95 * 0.055 / speed < remedy.value < 0.055 / speed


def test_remedy_of_walls_alike_holds_at_each_of_them() -> None:
    """One forecast stands for three walls, of which the ball passes only one or two."""
    walls = [{"name": f"w{k}", "points": [[1.0 + k, -2.0], [1.0 + k, 2.0]], "thickness": 0.01} for k in range(3)]
    ball = {"name": "bullet", "position": [0.0, 0.0], "velocity": [12.0, 0.0], "radius": 0.05}
    scene = scene_of(0.0, 0.5, wall=walls, ball=[ball])
    (found,) = run_preflight(scene, engine="pymunk").warnings
    assert found.details["others"] == 2
    assert found.tried is not None
    remedy = found.tried[-1]
    assert remedy.holds
    for number in range(remedy.starts.trials):
        start = Starts(scene, step=DT).start(number)
        assert run(start, "pymunk", **{remedy.name: remedy.value}).missed_contacts == 0


def test_named_remedy_of_a_bullet_holds_in_the_starts_named() -> None:
    scene = bullet(12.0)
    (found,) = run_preflight(scene, engine="pymunk").warnings
    assert found.tried is not None
    (remedy,) = found.tried
    assert (remedy.name, remedy.holds, remedy.starts.trials) == ("dt", True, 30)
    assert 0.95 * 0.055 / 12.0 < remedy.value < 0.055 / 12.0
    missed = [
        run(Starts(scene, step=DT).start(number), "pymunk", dt=remedy.value).missed_contacts for number in range(30)
    ]
    assert missed == [0] * 30


def test_work_bounds_the_starts_and_one_start_is_the_scene_as_it_is() -> None:
    balls = [{"position": [0.3 * (k % 30), 0.2 + 0.3 * (k // 30)], "radius": 0.1} for k in range(600)]
    crowd = run_preflight(scene_of(plane=[FLOOR], ball=balls), engine="pymunk").tried
    assert crowd is not None
    assert 1 < crowd.starts < 15
    assert (crowd.asked, crowd.limited_by) == (30, "more would exceed the counted work of 1 s")
    assert not crowd.whole
    alone = run_preflight(bullet(12.0), engine="pymunk", starts=1)
    assert alone.tried is not None
    assert (alone.tried.starts, alone.tried.asked, alone.tried.limited_by) == (1, 1, None)
    passed = run(bullet(12.0), "pymunk").missed_contacts
    assert [each.is_observed for each in alone.warnings] == [True] * passed


def test_problem_that_no_start_shows_is_a_note_with_the_interval() -> None:
    """The box is struck by a light ball, and the formula gives it all of the energy."""
    heavy = {"name": "heavy", "position": [0.0, 0.0], "velocity": [2.0, 0.0], "radius": 0.3, "mass": 10.0}
    light = {"name": "light", "position": [2.0, 3.0], "radius": 0.05, "mass": 0.05}
    wall = {"name": "pane", "points": [[4.0, -5.0], [4.0, 5.0]], "thickness": 0.02}
    found = run_preflight(scene_of(0.0, 2.0, ball=[heavy, light], wall=[wall]), engine="pymunk")
    assert found.warnings == []
    assert found.refuted
    for each in found.refuted:
        assert "none of 30 starts on pymunk (95 % interval 0 to 11 %)" in each.message


def test_trial_that_cannot_see_the_ends_of_a_turning_bar_at_a_wall_refutes_nothing() -> None:
    """The inscribed disc of the bar never touches the post that its end passes."""
    bar = {"name": "bar", "position": [0.0, 0.0], "size": [2.0, 0.04], "angular_velocity": 60.0, "velocity": [0.0, 6.0]}
    post = {"name": "peg", "position": [0.7, 0.5], "radius": 0.01}
    scene = scene_of(0.0, 0.2, box=[bar], post=[post])
    assert run(scene, "pymunk").missed_contacts == 0
    by_formula = {each.kind for each in run_preflight(scene, engine="pymunk", cover=0.0).warnings}
    kept = {each.kind for each in run_preflight(scene, engine="pymunk").warnings}
    assert "tunnelling" in by_formula & kept


@pytest.mark.parametrize("scene", LOADED, ids=["rope", "tower", "crushed"])
def test_no_warning_on_box2d_mentions_iterations(scene: Scene) -> None:
    """They do nothing there."""
    assert "iterations" not in " ".join(each.message for each in run_preflight(scene, engine="box2d").warnings)


@given(st.integers(0, 10_000), st.floats(2.0, 9.0))
@settings(max_examples=20)
def test_no_remedy_is_a_longer_step(seed: int, speed: float) -> None:
    """Balls graze each other: they touch for less than a substep, and are too slow to tunnel."""
    rng = np.random.default_rng(seed)
    places = [(0.5 + 0.6 * k, 0.5 + 0.6 * j) for k in range(4) for j in range(3)]
    balls = [
        {"position": place, "velocity": (speed * rng.uniform(-1.0, 1.0, 2)).tolist(), "radius": 0.2, "restitution": 1.0}
        for place in places
    ]
    wall = {"points": [[0.0, 0.0], [3.0, 0.0], [3.0, 2.4], [0.0, 2.4]], "closed": True, "restitution": 1.0}
    scene = scene_of(0.0, 4.0, ball=balls, wall=[wall])
    for each in run_preflight(scene, engine="pymunk", starts=2).warnings:
        assert float(each.details.get("safe_dt", 0.0)) < DT


def bar(length: float, spin: float) -> Scene:
    box = {
        "name": "bar",
        "position": [0.0, 0.0],
        "size": [length, 0.06],
        "kinematic": True,
        "angular_velocity": spin,
    }
    angle = 0.5 * spin * DT + math.pi * (spin * DT < 0.0)  # in the middle of the first step
    ball = {
        "name": "ball",
        "position": [0.4 * length * math.cos(angle), 0.4 * length * math.sin(angle)],
        "radius": 0.03,
    }
    return scene_of(0.0, 0.3, box=[box], ball=[ball])


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_trial_that_cannot_see_the_ends_of_a_bar_refutes_nothing(engine: str) -> None:
    scene = bar(4.0, 30.0)
    assert run(scene, engine).velocity[-1, 1] == pytest.approx([0.0, 0.0])  # it has passed through the ball
    assert "tunnelling" in {each.kind for each in run_preflight(scene, engine=engine).warnings}


def test_trial_that_cannot_follow_a_body_around_its_centre_refutes_nothing() -> None:
    """A boomerang, whose centre of mass lies outside of it, is not audited."""
    arms = [
        {"length": 1.6, "radius": 0.02, "position": [x, 0.5], "angle": angle} for x, angle in ((0.6, 0.8), (-0.6, -0.8))
    ]
    boomerang = {"name": "boomerang", "position": [0.0, 0.0], "angular_velocity": 30.0, "capsule": arms}
    ball = {"name": "b", "position": [3.0, 0.6], "velocity": [-60.0, 0.0], "radius": 0.02}
    scene = scene_of(0.0, 0.3, body=[boomerang], ball=[ball])
    assert scene.bodies.core.min() == 0.0
    assert "tunnelling" in {each.kind for each in run_preflight(scene, engine="pymunk").warnings}


def test_slow_bar_is_refuted() -> None:
    found = run_preflight(bar(4.0, 0.5), engine="pymunk")
    assert "tunnelling" not in {each.kind for each in found.warnings}


@given(st.floats(1e-3, 1.0), st.floats(1.0, 20.0), st.floats(0.01, 0.1), st.floats(0.5, 1.0), st.sampled_from([1, 2]))
@settings(max_examples=30)
def test_light_ball_between_a_heavy_one_and_a_wall_does_not_tunnel_at_a_safe_dt(
    light: float, speed: float, radius: float, fraction: float, substeps: int
) -> None:
    """Each impact makes it faster, up to the energy of both."""
    heavy = {"name": "heavy", "position": [0.0, 0.0], "velocity": [speed, 0.0], "radius": 0.5, "mass": 1.0}
    ball = {"name": "light", "position": [1.5, 0.0], "radius": radius, "mass": light}
    elastic = [{**each, "restitution": 1.0} for each in (heavy, ball)]
    wall = {"points": [[2.0, -1.0], [2.0, 1.0]], "restitution": 1.0}
    solver = {"dt": 1e-3, "substeps": substeps}
    scene = scene_of(0.0, 2.0 / speed, ball=elastic, wall=[wall], solver=solver)
    safe = largest_safe_dt(scene, engine="pymunk")
    assert safe is not None
    done = run(scene, "pymunk", dt=fraction * safe)
    assert done.missed_contacts == 0
    assert done.position[-1, 1, 0] < 2.0


@pytest.mark.parametrize("depth", [0.05, 0.5, 0.9])
@pytest.mark.parametrize("body", ["box", "ball"])
@pytest.mark.parametrize("ground", ["box", "wall", "post"])
def test_body_that_starts_inside_a_fixed_one_is_named_so(depth: float, body: str, ground: str) -> None:
    thing: dict[str, Any] = {
        "box": {"name": "ground", "position": [0.0, -1.0], "size": [8.0, 2.0], "fixed": True},
        "wall": {"name": "ground", "points": [[-4.0, -1.0], [4.0, -1.0]], "thickness": 2.0},
        "post": {"name": "ground", "position": [0.0, -3.0], "radius": 3.0},
    }[ground]
    mover = {
        "name": "crate",
        "position": [0.0, 0.5 - depth],
        **({"size": [1.0, 1.0]} if body == "box" else {"radius": 0.5}),
    }
    tables: dict[str, list[dict[str, Any]]] = {body: [mover]}
    tables.setdefault(ground, []).append(thing)
    (found,) = [each for each in run_preflight(scene_of(**tables), engine="pymunk").warnings if each.kind == "overlap"]
    assert found.message.startswith("'crate' starts inside the fixed 'ground', ")
    assert found.details["depth"] == pytest.approx(depth, rel=1e-6)


def pendulum() -> Scene:
    ball = {"name": "bob", "position": [1.0, 0.0], "radius": 0.05, "collides": "none"}
    joint = {"kind": "rod", "between": ["bob"], "anchors": [[0.0, 0.0], [0.0, 0.0]], "length": 1.0}
    return scene_of(duration=60.0, ball=[ball], joint=[joint])


def elastic_ball() -> Scene:
    ball = {"position": [0.0, 5.5], "radius": 0.5, "restitution": 1.0}
    return scene_of(duration=60.0, plane=[{**FLOOR, "restitution": 1.0}], ball=[ball])


def test_small_odds_of_many_bodies_are_a_warning() -> None:
    """Each of 40 balls tunnels with odds of 2.5 %: one of them does in 1 − 0.975^40 = 64 % of the starts."""
    speed, radius = 20.0, 20.0 * DT * 0.975 - 0.01  # radius plus half the thickness is 0.975 of a step
    rows = [3.0 * k for k in range(40)]
    balls = [
        {"position": [-speed * (0.4 + 0.00021 * k), y], "velocity": [speed, 0.0], "radius": radius}
        for k, y in enumerate(rows)
    ]
    walls = [{"points": [[0.0, y - 1.0], [0.0, y + 1.0]], "thickness": 0.02} for y in rows]
    for count, is_warned in ((40, True), (1, False)):
        scene = scene_of(0.0, 0.6, ball=balls[:count], wall=walls[:count])
        found = run_preflight(scene, engine="pymunk", cover=0.4, starts=5)  # the trial runs end before the impacts
        warned, noted = (
            [each for each in some if each.kind == "tunnelling" and each.details["thing"] in scene.fixed_names]
            for some in (found.warnings, found.refuted)
        )
        assert (len(warned), len(noted)) == ((1, 0) if is_warned else (0, 1))
        if is_warned:
            assert warned[0].odds_of_any == pytest.approx(1.0 - 0.975**40, abs=0.01)  # speeds and widths are rounded
            assert "odds up to 2.5 % each" in warned[0].message


@pytest.mark.parametrize(
    ("scene", "engine", "loses"),
    [(pendulum(), "pymunk", True), (elastic_ball(), "box2d", True), (elastic_ball(), "reference", False)],
    ids=["pendulum on pymunk", "elastic ball on box2d", "elastic ball on reference"],
)
def test_energy_that_a_scene_conserves_and_an_engine_loses_is_warned_of(scene: Scene, engine: str, loses: bool) -> None:
    found = {each.kind for each in run_preflight(scene, engine=engine).warnings}
    assert ("energy_loss" in found) == loses


def test_flat_landings_on_box2d_are_as_the_note_says() -> None:
    """A rise of 0.64 m becomes one of 0.28 to 0.32 m with 1 to 16 substeps, and pymunk is right."""
    box = {"name": "flat", "position": [0.0, 1.25], "size": [1.0, 0.5]}
    scene = scene_of(duration=1.0, plane=[{**FLOOR, "restitution": 0.8}], box=[box], solver={"dt": 1e-3})
    rises = []
    for engine, substeps in (("box2d", 1), ("box2d", 16), ("pymunk", 1)):
        done = run(scene, engine, substeps=substeps)
        landed = int((done.velocity[:, 0, 1] > 0.0).argmax())
        rises.append(float(done.position[landed:, 0, 1].max()) - 0.25)
    assert rises == pytest.approx([0.28, 0.32, 0.64], abs=0.01)
    assert "box2d_bounces" in {each.kind for each in notes(scene, "box2d")}
    for other in (scene_of(plane=[FLOOR], box=[box]), scene_of(plane=[{**FLOOR, "restitution": 0.8}], ball=[BALL])):
        assert "box2d_bounces" not in {each.kind for each in notes(other, "box2d")}


BALL = {"name": "ball", "position": [0.0, 0.5], "radius": 0.5, "friction": 1.0}


@pytest.mark.parametrize(("speed", "is_noted"), [(20.0, True), (2.0, False)])
def test_fast_rolling_on_box2d_is_as_the_note_says(speed: float, is_noted: bool) -> None:
    ball = {**BALL, "velocity": [speed, 0.0], "angular_velocity": -2.0 * speed}
    wall = {"points": [[-5.0, 0.0], [300.0, 0.0]], "friction": 1.0}
    scene = scene_of(duration=5.0, wall=[wall], ball=[ball])
    done = run(scene, "box2d", substeps=1)
    sunk, lost = 0.5 - float(done.position[:, 0, 1].min()), 1.0 - float(done.velocity[-1, 0, 0]) / speed
    assert (sunk > 0.02 and lost > 0.008) == is_noted
    assert ("box2d_rolling" in {each.kind for each in notes(scene, "box2d")}) == is_noted


@pytest.mark.parametrize("substeps", [1, 4, 16])
def test_servo_on_pymunk_lags_by_the_error_in_the_note(substeps: int) -> None:
    """0.6 rad times c·h/I of a rod of 1 m on a hinge at its end; 1.9957 rad at 0.5 s is the limit of small steps."""
    box = {"name": "arm", "position": [0.5, 0.0], "size": [1.0, 0.1], "mass": 1.0}
    hinge = {"kind": "pivot", "between": ["arm"], "at": [0.0, 0.0]}
    servo = {
        "kind": "rotary_spring",
        "between": ["arm"],
        "rest_angle": 0.75 * math.pi,
        "stiffness": 10.0,
        "damping": 3.0,
    }
    solver = {"dt": DT, "substeps": substeps}
    scene = scene_of(0.0, 0.5, box=[box], joint=[hinge, {**servo, "name": "servo"}], solver=solver)
    (note,) = [each for each in notes(scene, "pymunk") if each.kind == "pymunk_damper"]
    ratio = 3.0 * DT / substeps / ((1.0 + 0.01) / 12.0)
    assert note.details["ratio"] == pytest.approx(ratio, rel=1e-9)
    lag = 1.9957 - float(run(scene, "pymunk").angle[-1, 0])
    assert lag == pytest.approx(0.6 * ratio, rel=0.1)
    assert float(run(scene, "reference").angle[-1, 0]) == pytest.approx(1.9957, abs=0.013)
