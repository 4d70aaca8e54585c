"""Marks of the live check in the editor: where they are, the plate, and remedies by a click."""

import time

import numpy as np
import pygame
import pytest

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.window.camera import Camera
from sandbox.window.editor.check_marks import CheckMarks, EngineChip, PlatePart
from sandbox.window.editor.live_check import CheckResult, Remedy, SceneMark, check_scene
from tests.toml_text import toml
from tests.window.editor.hand import Hand, OpenOn
from tests.window.pressing import key, move, press, release

TEXT = (
    toml("world", gravity=[0, -9.81])
    + toml("solver", dt=0.01)
    + toml("plane", name="ground", point=[0, 0], normal=[0, 1])
    + toml("wall", name="paddle", points=[[3, 0.5], [3, 4]], thickness=0.05)
    + toml("ball", name="bullet", position=[-4, 2], velocity=[30, 0], radius=0.1)
    + toml("ball", name="sunk", position=[-1.5, 0.2], radius=0.4)
)
AREA = pygame.Rect(70, 60, 900, 560)
BACKGROUND = (1, 2, 3)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return loads(TEXT)


@pytest.fixture(scope="module")
def result(scene: Scene) -> CheckResult:
    return check_scene(scene)


def drawn(
    marks: CheckMarks,
    scene: Scene,
    result: CheckResult | None,
    area: pygame.Rect = AREA,
    ui_scale: float = 1.0,
    size: tuple[int, int] = (1280, 720),
) -> pygame.Surface:
    surface = pygame.Surface(size)
    surface.fill(BACKGROUND)
    marks.draw(surface, Camera((0.0, 2.0), 60.0, size), scene, result, area, ui_scale)
    return surface


def mark_of(result: CheckResult, kind: str) -> SceneMark:
    return next(mark for mark in result.marks if mark.kind == kind)


def click(marks: CheckMarks, position: tuple[int, int]) -> tuple[bool, Remedy | None]:
    marks.handle_event(move(*position))
    used, nothing = marks.handle_event(press(*position))
    assert nothing is None
    released, found = marks.handle_event(release(*position))
    assert released == used
    return used, found


def assert_only_within(surface: pygame.Surface, area: pygame.Rect) -> None:
    pixels = pygame.surfarray.array3d(surface)
    is_changed = (pixels != np.asarray(BACKGROUND)).any(axis=2)
    assert is_changed.any()
    is_changed[area.left : area.right, area.top : area.bottom] = False
    assert not is_changed.any()


def test_marks_are_at_their_elements(scene: Scene, result: CheckResult) -> None:
    marks = CheckMarks()
    drawn(marks, scene, result)
    camera = Camera((0.0, 2.0), 60.0, (1280, 720))
    on_scene = [rect for rect in marks.rects_of(mark_of(result, "overlap")) if not marks.rect.contains(rect)]
    ball = camera.to_screen(np.asarray((-1.1, 0.6)))  # upper right corner
    ground = camera.to_screen(np.asarray((0.0, 0.0)))
    assert len(on_scene) == 2
    assert any(np.hypot(*(np.asarray(rect.center) - ball)) < 15 for rect in on_scene)
    assert any(abs(rect.centery - ground[1]) < 2 for rect in on_scene)


def test_click_on_a_mark_shows_its_message_and_a_click_on_a_remedy_returns_it(
    scene: Scene, result: CheckResult
) -> None:
    marks, mark = CheckMarks(), mark_of(result, "overlap")
    drawn(marks, scene, result)
    assert marks.shown is None
    on_scene = next(rect for rect in marks.rects_of(mark) if not marks.rect.contains(rect))
    assert click(marks, on_scene.center) == (True, None)
    marks.handle_event(move(500, 100))
    drawn(marks, scene, result)
    assert marks.shown == mark  # it stays when the pointer leaves
    (remedy,) = mark.remedies
    (button,) = marks.rects_of(remedy)
    assert marks.card.contains(button)
    assert click(marks, button.center) == (True, remedy)
    assert marks.shown is None
    assert click(marks, (500, 100)) == (False, None)


def test_message_is_shown_while_the_pointer_is_at_a_mark_or_at_the_message(scene: Scene, result: CheckResult) -> None:
    marks, mark = CheckMarks(), mark_of(result, "tunnelling")
    drawn(marks, scene, result)
    line = next(rect for rect in marks.rects_of(mark) if marks.rect.contains(rect))
    assert marks.handle_event(move(*line.center)) == (False, None)
    drawn(marks, scene, result)
    assert marks.shown == mark
    marks.handle_event(move(*marks.card.center))
    drawn(marks, scene, result)
    assert marks.shown == mark
    assert not marks.card.colliderect(marks.rect)
    marks.handle_event(move(500, 100))
    drawn(marks, scene, result)
    assert marks.shown is None
    assert marks.plates == [marks.rect]


def test_escape_and_a_click_elsewhere_close_the_message(scene: Scene, result: CheckResult) -> None:
    marks, mark = CheckMarks(), mark_of(result, "overlap")
    drawn(marks, scene, result)
    line = marks.rects_of(mark)[0].center
    click(marks, line)
    assert marks.shown == mark
    assert marks.handle_event(key(pygame.K_ESCAPE)) == (True, None)
    assert marks.shown is None
    assert marks.handle_event(key(pygame.K_ESCAPE)) == (False, None)
    click(marks, line)
    assert click(marks, (500, 100)) == (False, None)
    assert marks.shown is None


def test_message_follows_the_same_problem_into_a_new_result(scene: Scene, result: CheckResult) -> None:
    marks, mark = CheckMarks(), mark_of(result, "overlap")
    drawn(marks, scene, result)
    click(marks, marks.rects_of(mark)[0].center)
    moved = loads(TEXT.replace("[-1.5, 0.2]", "[-1.5, 0.3]"))
    drawn(marks, moved, check_scene(moved))
    assert marks.shown is not None
    assert marks.shown.kind == "overlap"
    assert marks.shown != mark
    drawn(marks, moved, CheckResult())
    assert marks.shown is None


def test_plate_folds_to_its_heading_and_unfolds(scene: Scene, result: CheckResult) -> None:
    marks = CheckMarks()
    drawn(marks, scene, result)
    height = marks.rect.height
    (heading,) = marks.rects_of(PlatePart.HEADING)
    assert click(marks, heading.center) == (True, None)
    assert marks.is_folded
    drawn(marks, scene, result)
    assert marks.rect.height < 0.4 * height
    assert marks.rect.bottomright == AREA.bottomright
    (heading,) = marks.rects_of(PlatePart.HEADING)
    click(marks, heading.center)
    drawn(marks, scene, result)
    assert marks.rect.height == height


def test_plate_consumes_clicks_but_not_the_motion(scene: Scene, result: CheckResult) -> None:
    marks = CheckMarks()
    drawn(marks, scene, result)
    at = marks.rect.left + 2, marks.rect.bottom - 2
    assert click(marks, at) == (True, None)
    assert marks.handle_event(press(*at, button=3)) == (True, None)
    assert marks.handle_event(move(*at)) == (False, None)


def test_marks_on_the_scene_are_passive_while_something_is_drawn(scene: Scene, result: CheckResult) -> None:
    marks, mark = CheckMarks(), mark_of(result, "overlap")
    marks.takes_marks = False
    drawn(marks, scene, result)
    assert all(marks.rect.contains(rect) for rect in marks.rects_of(mark))
    assert marks.shown is None


def test_further_warnings_are_listed_in_turn(scene: Scene) -> None:
    many = CheckResult(tuple(SceneMark("rounding", f"message {k}", (), ()) for k in range(12)))
    marks = CheckMarks()
    found = set()
    for _ in range(4):
        drawn(marks, scene, many)
        found |= {mark.message for mark in many.marks if marks.rects_of(mark)}
        (more,) = marks.rects_of(PlatePart.MORE)
        click(marks, more.center)
    assert len(found) == 12


def test_lost_release_does_not_take_the_next_one(scene: Scene, result: CheckResult) -> None:
    marks = CheckMarks()
    drawn(marks, scene, result)
    marks.handle_event(press(*marks.rects_of(PlatePart.HEADING)[0].center))
    assert marks.handle_event(press(500, 100)) == (False, None)
    assert marks.handle_event(release(500, 100)) == (False, None)
    assert not marks.is_folded


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("size", "ui_scale", "area"),
    [
        ((1280, 720), 1.0, AREA),
        ((1280, 720), 2.0, pygame.Rect(180, 130, 480, 470)),
        ((1920, 1080), 1.0, pygame.Rect(70, 60, 1540, 960)),
        ((1920, 1080), 2.0, pygame.Rect(190, 130, 1180, 850)),
        ((640, 480), 1.0, pygame.Rect(70, 60, 250, 120)),
    ],
)
def test_nothing_is_drawn_outside_the_area(
    scene: Scene, result: CheckResult, size: tuple[int, int], ui_scale: float, area: pygame.Rect
) -> None:
    marks = CheckMarks()
    assert_only_within(drawn(marks, scene, None, area, ui_scale, size), area)
    assert_only_within(drawn(marks, scene, result, area, ui_scale, size), area)
    assert area.contains(marks.rect)
    for mark in result.marks:
        for rect in marks.rects_of(mark):
            assert area.contains(rect)
            marks.handle_event(move(*rect.center))
            assert_only_within(drawn(marks, scene, result, area, ui_scale, size), area)
            assert marks.card.width == 0 or area.contains(marks.card)
    for engine in result.engines:
        for rect in marks.rects_of(EngineChip(*engine)):
            marks.handle_event(move(*rect.center))
            assert_only_within(drawn(marks, scene, result, area, ui_scale, size), area)


def test_marks_of_elements_that_are_gone_or_out_of_sight_are_left_out(result: CheckResult) -> None:
    marks = CheckMarks()
    empty = loads("[world]\ngravity = [0, -9.81]\n")
    drawn(marks, empty, result)
    assert all(marks.rect.contains(rect) for mark in result.marks for rect in marks.rects_of(mark))
    far = loads(TEXT.replace("[-4, 2]", "[-400, 2]"))
    drawn(marks, far, result)
    mark = result.marks[0]
    on_scene = [rect for rect in marks.rects_of(mark) if not marks.rect.contains(rect)]
    assert len(on_scene) == len(mark.elements) - 1


# --- In the window ---------------------------------------------------------------------------------------------------


def wait_for_check(hand: Hand) -> None:
    end = time.monotonic() + 20.0
    hand.frame()
    while not hand.view.live_check.is_current:
        assert time.monotonic() < end
        time.sleep(0.01)
        hand.frame()
    hand.frame()


@pytest.mark.fail_slow(60)  # a window
def test_remedy_is_applied_to_the_draft_and_undone(open_on: OpenOn) -> None:
    hand = open_on(TEXT)
    view = hand.view
    wait_for_check(hand)
    assert view.live_check.result is not None
    mark = mark_of(view.live_check.result, "overlap")
    for target in (mark, mark.remedies[0]):
        center = view.check_marks.rects_of(target)[0].center
        hand.frame(move(*center), press(*center), release(*center))
        hand.frame()
    assert view.draft.scene.balls[1].position == (-1.5, 0.4)
    wait_for_check(hand)
    assert view.live_check.result is not None
    assert "overlap" not in {each.kind for each in view.live_check.result.marks}
    view.editor.undo()
    assert view.draft.text == TEXT


@pytest.mark.fail_slow(60)  # a window
def test_plate_leaves_the_toolbar_the_file_and_messages_free(open_on: OpenOn) -> None:
    hand = open_on(TEXT)
    view = hand.view
    wait_for_check(hand)
    assert not view.check_marks.rect.colliderect(view.toolbar.rect)
    assert not view.check_marks.rect.colliderect(view.actions.rect)
    assert hand.window.context.gui.area.contains(view.check_marks.rect)
    assert view.editor.selection == []
    center = view.check_marks.rects_of(PlatePart.HEADING)[0].center
    hand.frame(move(*center), press(*center), release(*center))
    assert view.check_marks.is_folded
    assert view.editor.selection == []
