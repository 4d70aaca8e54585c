"""Edit mode of the window, with events as SDL sends them: scenes built from nothing, saved, and run headless."""

import math
import threading
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.editing.elements import ElementKey
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.scene.files.toml_changes import SetValue
from sandbox.window.editor.toolbar import TOOLS, EditTool
from sandbox.window.playback.live import LiveView
from tests.window.editor.hand import BALL, CTRL, SHIFT, SIZE, Hand, OpenOn
from tests.window.pressing import move, press, release, wheel

pytestmark = pytest.mark.fail_slow(60)  # a window


def test_newtons_cradle_is_built_saved_and_run(hand: Hand, tmp_path: Path) -> None:
    hand.click((4.0, 4.0))  # clears the selection, so that the fields of the world are shown
    hand.set_field("world", "duration", "2.4")
    hand.key(pygame.K_b)
    for x in (-1.0, 0.0, 1.0):
        hand.drag((x, 1.0), (x + 0.4, 1.0), is_released=False)
        hand.type("0.5")
        hand.key(pygame.K_RETURN)
    hand.key(pygame.K_1)
    for x in (-1.0, 0.0, 1.0):
        hand.click((x, 1.0), (x, 4.0))
    hand.key(pygame.K_v)
    hand.drag((-2.0, 0.4), (2.0, 1.6))
    assert [each.table for each in hand.editor.selection] == ["ball"] * 3
    hand.set_field("selection:ball", "restitution", "1")
    hand.click((-1.0, 1.0))
    hand.set_field("selection:ball", "velocity", "-2, 0")
    hand.save_as(tmp_path / "cradle.toml")
    scene = load(tmp_path / "cradle.toml")
    written = loads(
        """
[world]
gravity = [0, -9.81]
duration = 2.4
[[plane]]
name = "ground"
point = [0, 0]
normal = [0, 1]
friction = 0.7071
restitution = 0.5
"""
        + "".join(
            f'[[ball]]\nname = "{name}"\nposition = [{x}, 1]\nradius = 0.5\nrestitution = 1\nfriction = 0.7071\n{more}'
            for name, x, more in (("ball", -1, "velocity = [-2, 0]\n"), ("ball 2", 0, ""), ("ball 3", 1, ""))
        )
        + "".join(
            f'[[joint]]\nname = "{rod}"\nkind = "rod"\nbetween = ["{ball}"]\nanchors = [[0, 0], [{x}, 4]]\n'
            for rod, ball, x in (("rod", "ball", -1), ("rod 2", "ball 2", 0), ("rod 3", "ball 3", 1))
        )
    )
    assert scene.balls == written.balls
    assert scene.joints == written.joints
    one, other = run(scene, "reference"), run(written, "reference")
    assert one.position.tobytes() == other.position.tobytes()
    right = one.position[:, 2, 0].max()
    assert right > 1.1  # the last ball was struck


def test_car_with_motor_wheels_and_spring_drives(hand: Hand, tmp_path: Path) -> None:
    hand.key(pygame.K_x)
    hand.drag((-1.0, 0.8), (1.0, 1.2))
    hand.key(pygame.K_b)
    for x in (-0.8, 0.8):
        hand.drag((x, 0.5), (x + 0.4, 0.5))
    hand.key(pygame.K_v)
    hand.click((-0.8, 0.4))
    hand.drag((-1.5, -0.2), (1.5, 2.0))
    hand.set_field("selection:ball", "friction", "1")
    for x in (-0.8, 0.8):
        hand.key(pygame.K_2 if x > 0 else pygame.K_5)
        hand.click((x, 0.85))
    joints = hand.scene.joints
    assert [joint.kind for joint in joints] == ["pivot", "motor", "pivot"]
    assert all(len(joint.between) == 2 for joint in joints)
    hand.save_as(tmp_path / "car.toml")
    found = run(load(tmp_path / "car.toml", ["world.duration=3"]), "pymunk")
    assert found.status == "ok"
    names = found.names.tolist()
    assert found.position[-1, names.index("box"), 0] > 1.0  # it has driven to the right


def test_pivot_joins_the_planks_under_it(hand: Hand) -> None:
    hand.key(pygame.K_x)
    for x in (-3.0, -1.0, 1.0):
        hand.drag((x, 2.0), (x + 2.0, 2.2))
    hand.key(pygame.K_2)
    hand.click((-3.0, 2.1), (-1.0, 2.1), (1.0, 2.1), (3.0, 2.1))
    assert [len(joint.between) for joint in hand.scene.joints] == [1, 2, 2, 1]


def test_lane_of_walls_and_posts(hand: Hand, tmp_path: Path) -> None:
    hand.key(pygame.K_w)
    hand.click((-2.0, 4.0), (-2.0, 1.0), (-1.0, 0.5))
    hand.key(pygame.K_RETURN)
    hand.click((2.0, 4.0), (3.0, 4.0), (3.0, 3.0), (2.0, 3.0), (2.0, 4.0))  # ends at its first corner
    hand.key(pygame.K_t)
    hand.drag((0.0, 2.5), (0.3, 2.5))
    hand.key(pygame.K_y)
    hand.click((-4.0, 1.0), (-3.0, 1.0), (-3.0, 2.0), (-4.0, 1.0))
    hand.save_as(tmp_path / "lane.toml")
    scene = load(tmp_path / "lane.toml")
    assert scene.walls[0].points == ((-2.0, 4.0), (-2.0, 1.0), (-1.0, 0.5))
    assert (len(scene.walls[1].points), scene.walls[1].closed) == (4, True)
    assert (scene.posts[0].position, scene.posts[0].radius) == ((0.0, 2.5), 0.3)
    assert scene.polygons[0].position == (-4.0, 1.0)
    assert scene.polygons[0].points == ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))


def test_running_starts_at_the_edited_scene_and_returning_restores_it(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.drag((0.0, 2.0), (0.0, 3.0))
    edited = hand.view.draft.text
    assert "position = [0.0, 3.0]  # above" in edited
    camera = hand.window.context.camera
    hand.key(pygame.K_SPACE)
    assert hand.window.editing is None
    live = hand.window.app_state.view
    assert isinstance(live, LiveView)
    assert live.frame.position[0].tolist() == [0.0, 3.0]
    assert hand.window.context.camera == camera
    for _ in range(10):
        hand.frame()
    assert live.step_number > 0
    hand.key(pygame.K_e, CTRL)
    assert hand.view.draft.text == edited
    hand.key(pygame.K_z, CTRL)  # also what was done before it ran
    assert hand.view.draft.text == BALL


def test_selection_by_click_shift_and_rubber_band(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    a, b = ElementKey("ball", 0), ElementKey("ball", 1)
    hand.click((0.0, 2.0))
    assert hand.editor.selection == [a]
    at = hand.pixel((2.0, 2.0))
    pygame.key.set_mods(SHIFT)
    hand.frame(press(*at), release(*at))
    assert hand.editor.selection == [a, b]
    hand.frame(press(*at), release(*at))
    assert hand.editor.selection == [a]
    pygame.key.set_mods(0)
    hand.drag((-1.0, 1.0), (3.0, 3.0))
    assert hand.editor.selection == [a, b]
    hand.key(pygame.K_ESCAPE)
    assert hand.editor.selection == []
    hand.key(pygame.K_a, CTRL)
    assert len(hand.editor.selection) == 3


def test_handles_rotate_and_scale(open_on: OpenOn) -> None:
    hand = open_on('[[box]]\nname = "a"\nposition = [0.0, 0.0]\nsize = [2.0, 1.0]\n')
    hand.click((0.0, 0.0))
    hand.frame()
    view = hand.view.view_scale
    rotate = next(handle for handle in hand.editor.handles(view) if handle.kind == "rotate")
    radius = math.hypot(*rotate.point)
    hand.drag(rotate.point, (radius * math.cos(math.radians(62)), radius * math.sin(math.radians(62))))
    assert math.isclose(hand.scene.boxes[0].angle, math.radians(-30), abs_tol=1e-8)  # in steps of 15°
    hand.key(pygame.K_z, CTRL)
    corner = next(handle for handle in hand.editor.handles(view) if handle.kind == "scale" and handle.index == 2)
    hand.drag(corner.point, (3.0, 1.5), is_released=False)
    hand.type("2")
    hand.key(pygame.K_RETURN)
    assert hand.scene.boxes[0].size == (4.0, 2.0)
    assert hand.scene.boxes[0].position == (1.0, 0.5)  # the opposite corner stays


def test_snapping_to_the_ground_and_suspending_it(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.drag((0.0, 2.0), (0.01, 0.515))
    assert hand.scene.balls[0].position == (0.0, 0.5)  # it lies on the ground
    pygame.key.set_mods(CTRL)
    hand.drag((0.0, 0.5), (0.513, 1.377))
    pygame.key.set_mods(0)
    x, y = hand.scene.balls[0].position
    assert math.hypot(x - 0.513, y - 1.377) < 0.02  # a pixel is 0.01 m


def test_fault_is_shown_at_the_element_and_changes_nothing(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    hand.set_field("selection:ball", "radius", "-1")
    assert hand.scene.balls[0].radius == 0.5
    assert hand.view.panel.has_focus  # the text stays, to be mended
    hand.key(pygame.K_ESCAPE)
    hand.set_field("selection:ball", "name", "b")
    assert hand.view.draft.text == BALL
    hand.key(pygame.K_ESCAPE)
    hand.key(pygame.K_v)
    assert not hand.editor.apply([SetValue(("ball", 0, "position"), [0.0, -3000.0])], "move")
    assert hand.editor.fault is not None
    assert "behind the plane" in hand.editor.fault[1]
    hand.frame()  # draws it


def test_editing_keys(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    hand.key(pygame.K_RIGHT)
    hand.key(pygame.K_RIGHT)
    x = hand.scene.balls[0].position[0]
    assert x > 0.0
    hand.key(pygame.K_z, CTRL)
    assert hand.view.draft.text == BALL  # both steps at once
    hand.key(pygame.K_d, CTRL)
    assert [ball.name for ball in hand.scene.balls] == ["a", "b", "a 2"]
    hand.key(pygame.K_c, CTRL)
    hand.key(pygame.K_v, CTRL)
    assert hand.scene.balls[-1].name == "a 3"
    hand.key(pygame.K_x, CTRL)
    assert len(hand.scene.balls) == 3
    hand.key(pygame.K_DELETE)  # nothing is selected
    assert len(hand.scene.balls) == 3
    hand.key(pygame.K_e)
    hand.click((2.0, 2.0))
    assert [ball.name for ball in hand.scene.balls] == ["a", "a 2"]
    for _ in range(4):
        hand.key(pygame.K_z, CTRL)
    hand.key(pygame.K_z, CTRL | SHIFT)
    assert len(hand.scene.balls) == 3


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_every_tool_has_a_key_and_a_button(hand: Hand, tool: EditTool) -> None:
    hand.key(pygame.key.key_code(tool.key))
    assert hand.editor.tool == tool.name
    hand.key(pygame.K_v)
    rect = hand.view.toolbar.rect_of(tool.name)
    hand.frame(press(*rect.center), release(*rect.center))
    assert hand.editor.tool == tool.name
    hand.click((0.0, 3.0))
    hand.key(pygame.K_ESCAPE)
    hand.key(pygame.K_ESCAPE)
    hand.key(pygame.K_ESCAPE)
    assert hand.editor.tool == "select"


def test_closing_ends_the_threads_of_the_editor(open_on: OpenOn) -> None:
    before = set(threading.enumerate())
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    hand.frame()
    begun = set(threading.enumerate()) - before
    assert {"sandbox check", "sandbox ghost path"} <= {thread.name for thread in begun}
    hand.view.close(is_lost=True)
    for thread in begun:
        if thread.name in ("sandbox check", "sandbox ghost path"):
            thread.join(120.0)  # it may be compiling kernels for the first time
            assert not thread.is_alive()


def test_saving_a_file_that_changed_on_disk_asks(open_on: OpenOn, tmp_path: Path) -> None:
    hand = open_on(BALL)
    path = tmp_path / "scene.toml"
    hand.drag((0.0, 2.0), (0.0, 3.0))
    path.write_text("# written by another program\n" + BALL)
    hand.key(pygame.K_s, CTRL)
    assert hand.view.prompt is not None
    assert "changed by another program" in hand.view.prompt.note
    assert path.read_text().startswith("# written by another")
    hand.key(pygame.K_RETURN)
    assert "Enter again replaces it" in hand.view.prompt.note
    hand.key(pygame.K_RETURN)
    assert hand.view.prompt is None
    assert path.read_text() == hand.view.draft.text


def test_unsaved_scene_is_asked_about_before_quitting(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    hand.key(pygame.K_DELETE)
    hand.key(pygame.K_ESCAPE)
    assert hand.window.context.exit_status is None
    assert "not saved" in (hand.window.app_state.question or "")
    hand.frame()
    hand.key(pygame.K_z, CTRL)
    assert hand.window.app_state.question is None
    hand.key(pygame.K_ESCAPE)
    assert hand.window.context.exit_status == 0


def test_scene_of_a_preset_is_taken_apart(open_on: OpenOn) -> None:
    hand = open_on(find("9-ball"))
    ball = hand.scene.balls[0].position
    hand.click(ball)
    assert hand.editor.selection == []
    hand.key(pygame.K_x, CTRL | SHIFT)
    hand.click(ball)
    assert hand.editor.selection == [ElementKey("ball", 0)]


def test_zoom_and_panel_work_while_editing(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    scale = hand.window.context.camera.scale
    hand.frame(move(400, 300), wheel(2))
    assert hand.window.context.camera.scale > scale
    hand.key(pygame.K_TAB)
    assert not hand.window.context.gui.panel.visible
    hand.key(pygame.K_F1)
    assert hand.window.context.gui.help.open
    hand.frame()
    hand.key(pygame.K_F1)
    assert not hand.window.context.gui.help.open
    assert hand.window.editing is not None


def test_velocity_is_set_by_its_arrow(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    view = hand.view.view_scale
    tip = next(handle for handle in hand.editor.handles(view) if handle.kind == "velocity").point
    hand.drag(tip, (0.5, 2.25), is_released=False)
    hand.type("3,-4")
    hand.key(pygame.K_RETURN)
    assert hand.scene.balls[0].velocity == (3.0, -4.0)
    tip = next(handle for handle in hand.editor.handles(view) if handle.kind == "velocity").point
    assert tip == (0.75, 1.0)  # 0.25 s of motion from the centre


def test_freehand_outline_becomes_a_polygon(hand: Hand) -> None:
    hand.key(pygame.K_y)
    circle = [(-2.0 + math.cos(a), 2.5 + math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 60).tolist()]
    hand.frame(move(*hand.pixel(circle[0])), press(*hand.pixel(circle[0])))
    for point in circle[1:]:
        hand.frame(move(*hand.pixel(point), held=True))
    hand.frame(release(*hand.pixel(circle[-1])))
    polygon = hand.scene.polygons[0]
    assert 8 <= len(polygon.points) < 40
    (left, bottom), (right, top) = hand.editor.selection_bounds() or ((0.0, 0.0), (0.0, 0.0))
    assert (left, right) == pytest.approx((-3.0, -1.0), abs=0.06)  # the tolerance, and a pixel
    assert (bottom, top) == pytest.approx((1.5, 3.5), abs=0.06)
    hand.key(pygame.K_w)
    hand.drag((1.0, 1.0), (3.0, 1.0), steps=12)
    assert [len(wall.points) for wall in hand.scene.walls] == [2]


def test_thrusts_and_attractions_are_drawn(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.key(pygame.K_f)
    hand.drag((0.0, 2.0), (0.0, 2.6), is_released=False)
    hand.type("12")
    hand.key(pygame.K_RETURN)
    thrust = hand.scene.thrusts[0]
    assert thrust.body == "a"
    assert thrust.force == pytest.approx((0.0, 12.0), abs=0.2)  # its direction is within a pixel
    hand.drag((1.0, 0.8), (1.0, 1.5))  # there is no body
    assert len(hand.scene.thrusts) == 1
    hand.key(pygame.K_g)
    hand.click((1.0, 0.9))
    hand.click((2.0, 2.0))
    assert hand.scene.attractions[0].toward == (1.0, 0.9)
    assert hand.scene.attractions[1].toward == "b"
    hand.key(pygame.K_v)
    hand.click((2.0, 2.0))
    hand.key(pygame.K_DELETE)
    assert [each.toward for each in hand.scene.attractions] == [(1.0, 0.9)]


def test_alignment_and_new_materials(open_on: OpenOn) -> None:
    hand = open_on(BALL.replace("[2.0, 2.0]", "[2.0, 3.0]"))
    hand.drag((-1.0, 1.0), (3.2, 4.0))
    assert len(hand.editor.selection) == 2
    hand.key(pygame.K_DOWN, CTRL)
    assert [ball.position[1] for ball in hand.scene.balls] == [2.0, 2.0]
    hand.key(pygame.K_z, CTRL)
    hand.key(pygame.K_UP, CTRL | SHIFT)
    assert [ball.position[1] for ball in hand.scene.balls] == [2.5, 2.5]
    hand.set_field("selection:ball", "material", "rubber")
    assert [ball.material for ball in hand.scene.balls] == ["rubber", "rubber"]
    assert [material.name for material in hand.scene.materials] == ["rubber"]
    hand.key(pygame.K_ESCAPE)
    hand.frame()
    assert hand.view.panel.heading_of("material:0") is not None


def test_materials_and_pairs_are_removed_if_nothing_names_them(open_on: OpenOn) -> None:
    materials = '[[material]]\nname = "wood"\n\n[[material]]\nname = "steel" # hard\n'
    pair = '[[pair]]\nbetween = ["wood", "wood"]\nfriction = 0.3\n'
    hand = open_on(materials + pair + BALL.replace('name = "b"', 'name = "b"\nmaterial = "steel"'))
    text = hand.view.draft.text

    hand.frame()
    for section in ("world", "solver"):  # folded, so that the materials are in view
        heading = hand.view.panel.heading_of(section)
        assert heading is not None
        hand.frame(press(*heading.center), release(*heading.center))
    hand.press_button("material:1")
    assert hand.view.draft.text == text and hand.warnings() == ["material steel is used by ball b"]
    hand.press_button("material:0")
    assert hand.view.draft.text == text and hand.warnings()[-1] == "material wood is used by pair pair-1"
    hand.press_button("pair:0")
    hand.press_button("material:0")
    assert [material.name for material in hand.scene.materials] == ["steel"]
    assert not hand.scene.pairs and "# hard" in hand.view.draft.text
    hand.key(pygame.K_z, CTRL)
    hand.key(pygame.K_z, CTRL)
    assert hand.view.draft.text == text


def test_ball_snaps_to_walls_and_other_balls(open_on: OpenOn) -> None:
    hand = open_on(BALL + "[[wall]]\npoints = [[-1.0, 4.0], [3.0, 4.0]]\nthickness = 0.2\n")
    hand.drag((0.0, 2.0), (0.0, 3.41))
    assert hand.scene.balls[0].position == pytest.approx((0.0, 3.4), abs=1e-9)  # 4 − 0.1 − 0.5
    hand.drag((0.0, 3.4), (1.01, 2.0))
    x, y = hand.scene.balls[0].position
    assert math.dist((x, y), (2.0, 2.0)) == pytest.approx(1.0, abs=1e-8)


def test_generators_are_taken_apart_on_request(open_on: OpenOn) -> None:
    hand = open_on(
        BALL + '# atoms\n[[grid]]\nname = "atom"\norigin = [0, 4]\ncolumns = 3\nspacing = [0.5, 0.5]\nradius = 0.2\n'
    )
    hand.click((0.5, 4.0))
    assert hand.editor.selection == [ElementKey("grid", 0)]
    hand.key(pygame.K_x, CTRL | SHIFT)
    assert [ball.name for ball in hand.scene.balls] == ["a", "b", "atom-1", "atom-2", "atom-3"]
    hand.key(pygame.K_z, CTRL)
    assert len(hand.scene.grids) == 1


def test_order_of_elements_is_changed(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    hand.key(pygame.K_PAGEUP)
    assert [ball.name for ball in hand.scene.balls] == ["b", "a"]
    assert hand.editor.selection == [ElementKey("ball", 1)]
    assert "position = [0.0, 2.0]  # above" in hand.view.draft.text
    hand.key(pygame.K_PAGEUP)  # it is the last one already
    hand.key(pygame.K_PAGEDOWN)
    assert hand.view.draft.text == BALL


def test_cursor_shows_what_a_press_does(open_on: OpenOn, monkeypatch: pytest.MonkeyPatch) -> None:
    hand = open_on(BALL)

    def cursor_at(x: float, y: float) -> int:
        pixel = round(x), round(y)
        monkeypatch.setattr(pygame.mouse, "get_pos", lambda: pixel)
        hand.frame(move(*pixel))
        return hand.view.cursor()

    ball = hand.pixel((0.0, 2.0))
    assert cursor_at(*hand.pixel((1.0, 3.0))) == pygame.SYSTEM_CURSOR_ARROW
    assert cursor_at(*ball) == pygame.SYSTEM_CURSOR_SIZEALL
    hand.click((0.0, 2.0))
    handles = hand.editor.handles(hand.view.view_scale)
    corner = next(each for each in handles if each.kind == "scale" and each.index == 1)
    assert cursor_at(*hand.pixel(corner.point)) == pygame.SYSTEM_CURSOR_SIZENWSE
    hand.key(pygame.K_b)
    assert cursor_at(*ball) == pygame.SYSTEM_CURSOR_CROSSHAIR
    assert cursor_at(SIZE[0] - 50, 100) == pygame.SYSTEM_CURSOR_ARROW  # the panel
    assert cursor_at(*hand.view.toolbar.rect_of("ball").center) == pygame.SYSTEM_CURSOR_ARROW


def test_bodies_keep_their_colours_while_others_come_and_go_also_when_the_scene_runs(open_on: OpenOn) -> None:
    apart = BALL.replace("[0.0, 2.0]", "[-5.0, 2.0]").replace("[2.0, 2.0]", "[5.0, 2.0]")
    hand = open_on("[world]\ngravity = [0.0, 0.0]\n" + apart)
    off = 0.2  # m from the centre, where the handles of a selection do not cover the body

    def colours() -> dict[str, tuple[int, ...]]:
        if hand.window.editing is not None:
            hand.editor.selection = []
        hand.frame(move(5.0, 5.0))
        view, found = hand.window.app_state.view, dict[str, tuple[int, ...]]()
        assert view is not None
        bodies = (view.scene if hand.window.editing is None else hand.scene).bodies
        for name, (x, y) in zip(bodies.names, bodies.position.tolist(), strict=True):
            pixel = hand.pixel((x + off, y + off))
            found[name] = tuple(hand.window.context.surface.get_at((round(pixel[0]), round(pixel[1]))))
        return found

    def check(count: int) -> None:
        now = colours()
        assert len(now) == count
        for name, colour in now.items():
            assert known.setdefault(name, colour) == colour, name

    known = colours()
    assert len(set(known.values())) == 2
    for number, (tool, place) in enumerate(
        [(pygame.K_x, -3.0), (pygame.K_b, -1.0), (pygame.K_x, 1.0), (pygame.K_c, 3.0)]
    ):
        hand.key(tool)
        hand.drag((place - 0.5, 1.5), (place + 0.5, 2.5))
        hand.key(pygame.K_v)
        check(3 + number)
    hand.click((-5.0, 2.0))
    hand.key(pygame.K_DELETE)
    check(5)
    hand.key(pygame.K_SPACE)
    assert hand.window.editing is None
    hand.key(pygame.K_p)
    check(5)
    hand.key(pygame.K_e, CTRL)
    hand.key(pygame.K_z, CTRL)
    check(6)
