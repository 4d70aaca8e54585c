"""Joints, drives and properties of the editor, with events as SDL sends them; what is built is run headless."""

import math
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Drive
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.forces import PlungerDrive, TorqueDrive
from sandbox.scene.description.joints import Gear, Groove, Pivot, Slide
from sandbox.scene.editing.elements import ElementKey
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.editor.edit_keys import HELP_GROUPS
from sandbox.window.editor.element_properties import property_sections
from tests.window.editor.hand import BALL, CTRL, SHIFT, Hand, OpenOn
from tests.window.pressing import press, release

pytestmark = pytest.mark.fail_slow(60)  # a window


def lasting(scene: Scene, duration: float) -> Scene:
    """Return a scene with another duration, s."""
    return scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})


def test_slide_keeps_its_distance_within_half_and_the_whole(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.key(pygame.K_6)
    hand.click((0.0, 2.0), (2.0, 2.0))
    (slide,) = hand.scene.joints
    assert isinstance(slide, Slide)
    assert (slide.between, slide.least, slide.most) == (("a", "b"), 1.0, 2.0)


def test_body_slides_along_a_groove(open_on: OpenOn) -> None:
    hand = open_on("[world]\ngravity = [0, -9.81]\n" + BALL)
    hand.key(pygame.K_7)
    hand.click((0.0, 2.0), (1.0, 1.0))
    (groove,) = hand.scene.joints
    assert isinstance(groove, Groove)
    assert (groove.between, groove.groove, groove.anchor) == (("a",), ((0.0, 2.0), (1.0, 1.0)), (0.0, 0.0))
    found = run(lasting(hand.scene, 0.5), "pymunk")
    x, y = found.position[-1, 0].tolist()
    assert math.isclose(x + y, 2.0, abs_tol=1e-3)  # on the line, to the error of the iterated joint
    assert x > 0.3  # g sin 45° · t² / 2 · cos 45° = 0.6 m in 0.5 s, at half of g for the slope


def test_groove_belongs_to_the_body_below(open_on: OpenOn) -> None:
    hand = open_on(
        BALL.replace(
            '[[ball]]\nname = "a"',
            '[[box]]\nname = "cart"\nposition = [0.0, 2.0]\nsize = [3.0, 0.4]\n[[ball]]\nname = "a"',
        )
    )
    hand.key(pygame.K_7)
    hand.click((1.2, 2.0))
    hand.key(pygame.K_ESCAPE)
    hand.click((0.0, 2.0), (1.0, 2.0))
    (groove,) = hand.scene.joints
    assert isinstance(groove, Groove)
    assert groove.between == ("a", "cart")  # boxes are drawn above balls, so that the box slides on the ball
    assert groove.groove == ((0.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize(("x", "sign"), [(1.5, -1.0), (3.0, 1.0)])
def test_gears_mesh_or_are_joined_by_a_belt(open_on: OpenOn, x: float, sign: float) -> None:
    text = BALL.replace("[2.0, 2.0]\nradius = 0.5", f"[{x}, 2.0]\nradius = 1.0")
    hand = open_on(text.replace('name = "b"', 'name = "b"\nangular_velocity = 1.0'))
    hand.key(pygame.K_8)
    hand.click((0.0, 2.0), (x, 2.0))
    (gear,) = hand.scene.joints
    assert isinstance(gear, Gear)
    assert gear.ratio == 2.0 * sign  # the small one turns twice as fast
    hand.key(pygame.K_2)  # hinges, so that only rotation remains
    hand.click((0.0, 2.0), (x, 2.0))
    found = run(lasting(hand.scene, 2.0), "pymunk")
    rates = found.angular_velocity[-1]
    assert math.isclose(rates[0], gear.ratio * rates[1], rel_tol=1e-3)  # the error of the first step has decayed
    assert abs(rates[1]) > 0.1


def test_selected_wall_is_divided_undone_and_named_in_the_history(open_on: OpenOn) -> None:
    hand = open_on(BALL + '[[wall]]\nname = "ramp"\npoints = [[-1, 1], [0, 0.5], [3, 0.3]]\n')
    before = hand.view.draft.text
    hand.click((-0.5, 0.75))
    assert hand.editor.selection == [ElementKey("wall", 0)]
    hand.key(pygame.K_x, CTRL | SHIFT)
    assert [(wall.name, len(wall.points)) for wall in hand.scene.walls] == [("ramp", 2), ("ramp 2", 2)]
    assert hand.view.draft.undo_label == "divide a wall" and "2 walls of two points" in hand.messages()
    hand.key(pygame.K_z, CTRL)
    assert hand.view.draft.text == before
    hand.click((1.5, 0.4))
    hand.key(pygame.K_x, CTRL | SHIFT)
    hand.click((1.5, 0.4))
    hand.key(pygame.K_x, CTRL | SHIFT)
    assert "has one side" in hand.warnings()[-1] and len(hand.scene.walls) == 2
    assert any("divide walls" in text for group in HELP_GROUPS for _, text in group.lines)


CAR = """[world]
gravity = [0, -9.81]
[[plane]]
name = "ground"
point = [0, 0]
normal = [0, 1]
friction = 0.8
[[box]]
name = "chassis"
position = [0.0, 0.7]
size = [2.0, 0.4]
[[ball]]
name = "wheel"
position = [-0.7, 0.4]  # below the lower side of the chassis, which it overlaps by 0.3 m
radius = 0.4
friction = 0.8
[[ball]]
name = "load"
position = [0.5, 1.2]  # rests on the chassis
radius = 0.3
"""


@pytest.mark.parametrize("key", [pygame.K_2, pygame.K_5])
@pytest.mark.parametrize("point", [(-0.7, 0.4), (-0.72, 0.42), (-0.7, 0.1), (-0.5, 0.6), (-0.95, 0.65)])
def test_wheel_is_joined_at_its_centre_to_the_chassis_that_it_overlaps(
    open_on: OpenOn, key: int, point: tuple[float, float]
) -> None:
    hand = open_on(CAR)
    hand.key(key)
    hand.click(point)
    pivot = hand.scene.joints[0]
    assert isinstance(pivot, Pivot)
    assert (pivot.between, pivot.at) == (("chassis", "wheel"), (-0.7, 0.4))
    assert "to the world" not in hand.messages()
    assert all(joint.between == pivot.between for joint in hand.scene.joints)
    if key == pygame.K_5:
        found = run(lasting(hand.scene, 1.0), "pymunk")
        wheel, chassis = (hand.scene.bodies.number_of[name] for name in ("wheel", "chassis"))
        cos, sin = math.cos(found.angle[-1, chassis]), math.sin(found.angle[-1, chassis])
        axle = np.array((-0.7 * cos + 0.3 * sin, -0.7 * sin - 0.3 * cos)) + found.position[-1, chassis]
        assert math.dist(axle, found.position[-1, wheel]) < 0.01  # the error of the iterated joint
        assert found.position[-1, wheel, 0] - found.position[0, wheel, 0] > 0.5  # it drives


@pytest.mark.parametrize(
    ("point", "mod", "between", "at"),
    [
        ((0.5, 1.3), 0, ("load",), (0.5, 1.2)),  # a ball that only touches the chassis
        ((0.8, 0.7), 0, ("chassis",), (0.8, 0.7 - 0.1)),  # on the grid of 0.2 m
        ((-0.7, 0.3), CTRL, ("wheel",), (-0.7, 0.3)),
        ((-0.7, 0.7), CTRL, ("chassis", "wheel"), (-0.7, 0.7)),
    ],
)
def test_pivot_with_the_world_says_so_and_ctrl_takes_what_lies_at_the_click(
    open_on: OpenOn, point: tuple[float, float], mod: int, between: tuple[str, ...], at: tuple[float, float]
) -> None:
    hand = open_on(CAR)
    hand.key(pygame.K_2)
    pygame.key.set_mods(mod)
    hand.click(point)
    (pivot,) = hand.scene.joints
    assert isinstance(pivot, Pivot)
    assert pivot.between == between
    assert pivot.at == pytest.approx(at, abs=0.02)  # a pixel and a half
    assert (f"joins {between[0]} to the world" in hand.messages()) == (len(between) == 1)


@pytest.mark.parametrize(
    ("key", "points", "message"),
    [
        (pygame.K_8, [(0.0, 2.0), (1.0, 4.0)], "a gear needs two bodies"),
        (pygame.K_7, [(1.0, 4.0), (1.0, 5.0)], "a groove needs a body that slides"),
        (pygame.K_7, [(0.0, 2.0), (0.0, 2.0)], "a groove needs a length"),
        (pygame.K_6, [(0.0, 2.0), (0.1, 2.0)], "both ends are on the same body"),
        (pygame.K_9, [(1.0, 4.0)], "a flipper needs a body"),
        (pygame.K_0, [(1.0, 4.0)], "a plunger needs a body"),
    ],
)
def test_impossible_joints_and_drives_say_what_would_be_right(
    open_on: OpenOn, key: int, points: list[tuple[float, float]], message: str
) -> None:
    hand = open_on(BALL)
    hand.key(key)
    hand.click(*points)
    assert hand.warnings()[-1].startswith(message)
    assert hand.view.draft.text == BALL


def test_flipper_and_plunger_drive_bodies(hand: Hand, tmp_path: Path) -> None:
    hand.key(pygame.K_c)
    hand.drag((-1.0, 2.0), (1.0, 2.0))
    hand.key(pygame.K_9)
    hand.click((-1.0, 2.0))
    drive = hand.scene.drives[0]
    assert isinstance(drive, TorqueDrive)
    assert (drive.pivot, drive.key, drive.stops[0]) == ((-1.0, 2.0), "left", 0.0)
    assert drive.stops[1] > 0.5
    assert hand.editor.selection == [ElementKey("capsule", 0)]  # its properties show the drive
    hand.frame()
    assert hand.view.panel.heading_of("drive:0") is not None
    hand.key(pygame.K_9)
    hand.click((-1.0, 2.0))
    assert hand.warnings()[-1].startswith("capsule has a drive already")
    hand.key(pygame.K_x)
    hand.drag((3.0, 2.0), (3.4, 3.0))
    hand.key(pygame.K_0)
    hand.drag((3.2, 2.5), (3.2, 2.0))
    plunger = hand.scene.drives[1]
    assert isinstance(plunger, PlungerDrive)
    assert (plunger.direction, plunger.travel, plunger.key) == ((0.0, 1.0), 0.5, "space")
    hand.set_field("drive:1", "draw_time", "0.2")
    hand.save_as(tmp_path / "table.toml")
    scene = load(tmp_path / "table.toml", ["world.duration=0.3"])
    names = list(scene.bodies.names)
    found = run(
        scene,
        "pymunk",
        actions=(Drive(time=0.0, drive="flipper", level=1.0), Drive(time=0.0, drive="plunger", level=1.0)),
    )
    swung = found.angle[:, names.index("capsule")]
    assert math.isclose(swung.max(), drive.stops[1], abs_tol=0.05)  # it reaches its stop
    assert np.flatnonzero(swung > 0.9 * drive.stops[1])[0] * np.diff(found.time)[0] < 0.15  # in about 40 ms
    assert math.isclose(found.position[:, names.index("box"), 1].min(), 2.0, abs_tol=0.01)  # drawn back by 0.5 m
    hand.press_button("drive:1")
    assert len(hand.scene.drives) == 1


def test_path_of_a_kinematic_body_is_made_in_the_panel_and_moved_with_it(open_on: OpenOn) -> None:
    """The rows of a path, and `one_way`, are those of kinematic bodies; the course is drawn and has no velocity."""
    hand = open_on('[[box]]\nname = "lift"\nposition = [0.0, 0.0]\nsize = [2.0, 0.4]\n')
    hand.click((0.0, 0.0))
    shown = {
        row.spec.key for section in property_sections(hand.view.draft, hand.editor.selection) for row in section.rows
    }
    assert "kinematic" in shown and not {"path.points", "one_way"} & shown
    hand.set_field("selection:box", "kinematic", "true")
    shown = {
        row.spec.key for section in property_sections(hand.view.draft, hand.editor.selection) for row in section.rows
    }
    assert {"path.points", "path.easing", "one_way"} <= shown
    hand.set_field("selection:box", "path.points", "0, 0; 0, 3")
    hand.set_field("selection:box", "path.period", "4")
    hand.set_field("selection:box", "path.easing", "smooth")
    motion = hand.scene.bodies.paths[0]
    assert motion.pose(1.0)[:2] == pytest.approx((0.0, 1.5)) and motion.is_smooth
    hand.drag((0.0, 0.0), (2.0, 0.0))
    assert hand.scene.bodies.paths[0].pose(2.0)[:2] == pytest.approx((2.0, 3.0))
    hand.set_field("selection:box", "path.pause", "9")  # longer than the cycle
    path = hand.scene.boxes[0].path
    assert path is not None and path.pause == 0.0


def test_nested_tables_lists_and_points_or_names_are_edited(open_on: OpenOn) -> None:
    text = BALL + "[[post]]\nposition = [-9.0, 1.0]\nradius = 0.3\n"
    text += "[[attraction]]\ntoward = [-20.0, 5.0]\nstrength = 1.0\n"
    hand = open_on(text)  # both lie to the left of the list of warnings, which may appear at any time
    hand.click((-9.0, 1.0))
    hand.set_field("selection:post", "kick.threshold", "0.1")
    assert hand.scene.posts[0].kick is None  # without a speed
    hand.set_field("selection:post", "kick.speed", "2")
    hand.set_field("selection:post", "kick.threshold", "0.2")
    kick = hand.scene.posts[0].kick
    assert kick is not None and (kick.speed, kick.threshold) == (2.0, 0.2)
    hand.set_field("selection:post", "layers", "ground, above")
    assert hand.scene.posts[0].layers == ("ground", "above")
    hand.set_field("selection:post", "kick.threshold", "")
    hand.set_field("selection:post", "kick.speed", "")
    assert hand.scene.posts[0].kick is None and "kick" not in hand.view.draft.text
    hand.click((-20.0, 5.0))
    hand.set_field("selection:attraction", "toward", "b")
    assert hand.scene.attractions[0].toward == "b"
    hand.set_field("selection:attraction", "toward", "nothing")
    assert hand.scene.attractions[0].toward == "b"


def test_pairs_of_materials_and_the_surface_are_added(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.press_button("material")
    hand.press_button("material")
    assert [each.name for each in hand.scene.materials] == ["material", "material 2"]
    for _ in range(4):
        hand.press_button("pair")
    assert [each.between for each in hand.scene.pairs] == [
        ("material", "material 2"), ("material", "material"), ("material 2", "material 2"),
    ]  # fmt: skip
    heading = hand.view.panel.heading_of("pair:0")
    assert heading is not None


def test_tables_of_play_and_parts_of_bodies_are_edited(open_on: OpenOn) -> None:
    text = BALL + '[[body]]\nname = "hammer"\nposition = [4.0, 2.0]\n'
    text += "box = [{ size = [0.2, 1.0] }, { size = [0.8, 0.3], position = [0.0, 0.5] }]\n"
    text += '\n[[play.marking]]\ncolour = "#ff0000"\nposition = [0.0, 0.0]\nradius = 1.0\n'
    hand = open_on(text)
    hand.click((4.0, 2.0))
    hand.set_field("body:0:box:1", "size", "1, 0.3")
    assert hand.scene.compounds[0].boxes[1].size == (1.0, 0.3)
    hand.press_button("body:0:box:1")
    assert len(hand.scene.compounds[0].boxes) == 1
    hand.key(pygame.K_ESCAPE)
    hand.frame()
    unfold(hand, "play:marking:0")
    hand.set_field("play:marking:0", "radius", "2")
    assert hand.scene.play.markings[0].radius == 2.0
    unfold(hand, "surface")
    hand.set_field("surface", "gravity", "9.8")
    assert hand.scene.surface is not None and hand.scene.surface.gravity == 9.8
    hand.press_button("surface")
    assert hand.scene.surface is None
    assert loads(hand.view.draft.text) == hand.scene


def test_sections_are_those_of_the_draft_when_several_events_come_at_once(open_on: OpenOn) -> None:
    hand = open_on("".join(f'[[material]]\nname = "m{k}"\n' for k in range(3)) + BALL)
    hand.frame()
    button = hand.in_view(lambda: hand.view.panel.button_of("material:2"))
    click = press(*button.center), release(*button.center)
    hand.frame(*click, *click)
    assert len(hand.scene.materials) >= 1  # and no exception
    assert hand.editor.set_value(("material", 7), "friction", 0.5) is not None
    hand.editor.set_value(("body", 0, "box", 7), "size", None)  # nothing to remove


def test_name_of_a_generator_is_written_for_a_joint_to_one_of_its_bodies(open_on: OpenOn) -> None:
    rope = "[[rope]]\nstart = [{0}, 4]\nend = [{1}, 4]\nlinks = 4\nradius = 0.1\n"
    hand = open_on(BALL + rope.format(-4, -2) + rope.format(-1, 1) + rope.format(2, 4))
    node = hand.scene.bodies.position[hand.scene.bodies.number_of["rope-2-2"]].tolist()
    hand.key(pygame.K_1)
    hand.click((node[0], node[1]), (0.0, 2.0))
    assert [each.name for each in hand.scene.ropes] == [None, "rope-2", None]
    hand.key(pygame.K_v)
    hand.editor.selection = [ElementKey("rope", 0)]
    hand.key(pygame.K_DELETE)
    assert [each.name for each in hand.scene.ropes] == ["rope-2", "rope-3"]  # which would be the second one's name
    x = hand.scene.bodies.position[hand.scene.bodies.number_of[hand.scene.joints[0].between[0]], 0]
    assert x == node[0]  # still the same rope
    hand.editor.set_property([ElementKey("rope", 0)], "name", "line")
    assert hand.scene.joints[0].between == ("line-2", "a")


def test_names_of_several_and_references_of_play(open_on: OpenOn) -> None:
    hand = open_on(BALL + '[play]\narrows = "a"\n')
    keys = [ElementKey("ball", 0), ElementKey("ball", 1)]
    assert hand.editor.set_property(keys, "name", "c") is None
    assert [ball.name for ball in hand.scene.balls] == ["c", "c 2"]
    assert hand.scene.play.arrows == "c"
    hand.editor.selection = keys
    hand.key(pygame.K_DELETE)
    assert not hand.scene.balls and hand.scene.play.arrows is None


def test_last_part_of_a_kind_and_second_motor(open_on: OpenOn) -> None:
    parts = "box = [{ size = [0.2, 1.0] }]\nball = [{ radius = 0.3 }]\n"
    hand = open_on(BALL + f'[[body]]\nname = "hammer"\nposition = [4.0, 2.0]\n{parts}')
    hand.editor.remove_table(("body", 0, "box", 0))
    assert not hand.scene.compounds[0].boxes
    hand.key(pygame.K_5)
    hand.click((0.0, 2.0))
    hand.editor.selection = [ElementKey("joint", 0)]
    hand.key(pygame.K_DELETE)
    hand.click((2.0, 2.0))
    assert len({joint.name for joint in hand.scene.joints}) == 3


def unfold(hand: Hand, section: str) -> None:
    """Click a heading of the property panel."""
    heading = hand.in_view(lambda: hand.view.panel.heading_of(section))
    hand.frame(press(*heading.center), release(*heading.center))


def test_table_of_a_preset_is_edited(open_on: OpenOn) -> None:
    hand = open_on(find("9-ball"))
    before = hand.scene.balls
    assert hand.view.draft.preset_table is not None
    hand.set_field("billiards", "gap", "0.001")
    assert hand.view.draft.document["billiards"]["gap"] == 0.001
    assert hand.scene.balls != before
    hand.key(pygame.K_z, CTRL)
    assert hand.scene.balls == before
