"""Likely mistakes: gravity upwards, angles in degrees, and restitutions that multiply."""

import re
from pathlib import Path

import pytest

from sandbox.measure.preflight import Diagnostic, likely_mistakes
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import shipped
from tests.cli.calling import lines_of, write_scene

FLOOR = "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
CARTS = (
    "[[ball]]\nname = 'A'\nposition = [-1, 0]\nradius = 0.1\nrestitution = {}\n"
    "[[ball]]\nname = 'B'\nposition = [0, 0]\nradius = 0.1\nrestitution = {}\n"
)


def ball(gravity: float, rest: str = "") -> str:
    return f"[world]\ngravity = [0, {gravity}]\n[[ball]]\nposition = [0, 5]\nradius = 0.5\n{rest}"


def found(text: str) -> list[Diagnostic]:
    return list(likely_mistakes(loads(text)))


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        (ball(9.81), ["gravity_upwards"]),
        (ball(1.6, FLOOR), ["gravity_upwards"]),
        (ball(1.6), []),  # smoke
        (ball(-9.81, FLOOR), []),
        (ball(9.81, "fixed = true\n"), []),
        (ball(9.81).replace("0.5", "50"), ["pixels"]),  # which names the direction too
    ],
)
def test_gravity_upwards_has_a_note(text: str, kinds: list[str]) -> None:
    assert [each.kind for each in found(text)] == kinds


@pytest.mark.parametrize(("time", "kinds"), [(3.0, ["late_events"]), (2.99, [])])
def test_event_after_the_end_of_a_run_has_a_note(time: float, kinds: list[str]) -> None:
    event = f"[[event]]\ntime = {time}\nkind = 'remove'\nbody = 'ball-1'\n"
    text = ball(-9.81, FLOOR + event).replace("[world]", "[world]\nduration = 3.0")
    assert [each.kind for each in found(text)] == kinds


@pytest.mark.parametrize(("angle", "radians"), [("45", "0.7854"), ("-90", "-1.571"), ("6.2832", None), ("0.8", None)])
def test_angle_beyond_a_turn_is_given_in_radians(angle: str, radians: str | None) -> None:
    box = f"[[box]]\nname = 'b'\nposition = [0, 5]\nsize = [1, 1]\nangle = {angle}\n"
    part = f"[[body]]\nname = 'c'\nposition = [0, 5]\n[[body.box]]\nsize = [1, 1]\nangle = {angle}\n"
    for text, name in ((box, "box.b"), (part, "body.c")):
        messages = [each.message for each in found(text)]
        if radians is None:
            assert messages == []
        else:
            assert f"is {radians}" in messages[0]
            assert name in messages[0]


def restitution(scene: Scene) -> float:
    """Return the restitution between the first two bodies."""
    surfaces = contact_matrix(scene).surfaces
    first, second = surfaces.of_body[:2]
    return float(surfaces.restitution[first, second])


@pytest.mark.parametrize(("e", "f"), [(0.5, 0.5), (0.9, 0.9), (0.4, 0.8)])
def test_remedy_of_multiplied_restitution_sets_the_first_value(e: float, f: float) -> None:
    text = CARTS.format(e, f)
    (note,) = found(text)
    assert note.details["restitution"] == restitution(loads(text)) == e * f
    assert f"{e * f:.4g} between 'A' ({e:g}) and 'B' ({f:g})" in note.message
    lines = "\n".join(re.findall("`([^`]*)`", note.message))
    for name in "AB":
        assert f"material = \"{name}\" to '{name}'" in note.message
        text = text.replace(f"name = '{name}'", f"name = '{name}'\nmaterial = '{name}'")
    repaired = f"{text}{lines}\n"
    assert restitution(loads(repaired)) == e
    assert found(repaired) == []


def test_remedy_for_balls_of_a_grid_names_the_grid() -> None:
    text = "[[grid]]\ncolumns = 3\nrows = 2\nspacing = [1, 1]\norigin = [0, 1]\nradius = 0.1\nrestitution = 0.5\n"
    (note,) = found(text)
    assert "material = \"grid-1\" to 'grid-1'" in note.message
    lines = "\n".join(re.findall("`([^`]*)`", note.message))
    repaired = f"{text}material = 'grid-1'\n{lines}\n"
    assert restitution(loads(repaired)) == 0.5
    assert found(repaired) == []


@pytest.mark.parametrize(
    "text",
    [
        CARTS.format(0.5, 1.0),
        CARTS.format(0.5, 0.0),
        CARTS.format(0.1, 0.5),
        CARTS.format(0.98, 0.98),
        CARTS.format(0.5, "0.5\ncollides = 'fixed'"),
        CARTS.format(0.5, 0.5).replace("restitution = 0.5", "", 1),
        "[play]\ngame = 'landing'\n" + CARTS.format(0.5, 0.5),
    ],
)
def test_restitution_without_an_unexpected_product_has_no_note(text: str) -> None:
    assert [each for each in found(text) if each.kind == "multiplied_restitution"] == []


def test_materials_are_named_and_the_pairs_beyond_three_counted() -> None:
    rubber = "[[material]]\nname = 'rubber'\nrestitution = 0.6\n"
    text = rubber + CARTS.format(0.5, 0.5).replace("restitution = 0.5", "material = 'rubber'")
    (note,) = found(text)
    assert 'lines `[[pair]]`, `between = ["rubber", "rubber"]`, `restitution = 0.6`' in note.message
    balls = (f"[[ball]]\nposition = [{k}, 0]\nradius = 0.1\nrestitution = 0.{k + 3}\n" for k in range(4))
    (note,) = found("".join(balls))
    assert note.details["pairs"] == 6
    assert "3 more pairs" in note.message


def test_run_and_check_print_a_mistake_once(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write_scene(tmp_path, ball(9.81, FLOOR))
    status, _, err = lines_of(capfd, "run", path, "--sweep", "solver.dt=0.01,0.02", "--quiet")
    assert (status, len(err)) == (0, 1)
    assert err[0].startswith(f"* {path}: world.gravity points up")
    _, out, _ = lines_of(capfd, "check", path)
    assert sum("world.gravity points up" in line for line in out) == 1


@pytest.mark.fail_slow(60)  # loads all shipped scenes
def test_shipped_scenes_have_no_likely_mistakes_but_two_that_multiply_restitution() -> None:
    found_in = {scene.name: {each.kind for each in likely_mistakes(load(scene.path))} for scene in shipped()}
    assert {name: kinds for name, kinds in found_in.items() if kinds} == {
        "joints/flipper": {"multiplied_restitution"},
        "tutorial/spaceship": {"multiplied_restitution"},
    }
