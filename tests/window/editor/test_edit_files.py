"""Edit mode and its file, and ways to leave it: nothing is lost or overwritten without a question."""

from collections.abc import Callable
from pathlib import Path

import pygame
import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from tests.toml_text import toml
from tests.window.editor.everything import ATTRACTED
from tests.window.editor.hand import BALL, CTRL, SHIFT, Hand, OpenOn
from tests.window.pressing import key, key_up, move, press, release

pytestmark = pytest.mark.fail_slow(60)  # a window

E, S, Z = pygame.K_e, pygame.K_s, pygame.K_z
AT = (0.0, 2.0)
"""Position of a ball, m."""


def failing(error: OSError) -> Callable[..., None]:
    """Return a replacement of a method of Path that fails."""

    def fail(path: Path, *_: object) -> None:
        raise type(error)(error.errno, error.strerror, str(path))

    return fail


FULL = failing(OSError(28, "No space left on device"))
DENIED = failing(PermissionError(13, "Permission denied"))


@pytest.fixture
def hand(open_on: OpenOn) -> Hand:
    """A window in which a file with two balls is edited."""
    return open_on(BALL)


def change(hand: Hand) -> str:
    """Move a ball of the draft; return the new text."""
    draft = hand.view.draft
    draft.replace_text(draft.text.replace("[0.0, 2.0]", "[1.0, 2.0]"), "move")
    return draft.text


def test_deleted_file_is_written_again_only_after_a_question(hand: Hand) -> None:
    text = change(hand)
    hand.path.unlink()
    hand.key(E, CTRL)
    hand.key(E, CTRL)
    assert hand.view.draft.text == text
    hand.key(S, CTRL)
    assert hand.view.prompt is not None
    assert hand.view.prompt.note
    assert not hand.path.exists()
    hand.key(pygame.K_RETURN)
    assert hand.view.prompt is None
    assert hand.path.read_text() == text


def test_unchanged_draft_of_a_deleted_or_faulty_file_stays(hand: Hand) -> None:
    for spoil in (hand.path.unlink, lambda: hand.path.write_text("no scene"), lambda: hand.path.write_bytes(b"\xff")):
        spoil()
        hand.key(E, CTRL)
        hand.key(E, CTRL)
        assert hand.view.draft.text == BALL


def test_file_that_became_a_folder_can_be_saved_elsewhere(hand: Hand, tmp_path: Path) -> None:
    text = change(hand)
    hand.path.unlink()
    hand.path.mkdir()
    hand.key(S, CTRL)
    for _ in range(3):
        hand.key(pygame.K_RETURN)
    assert hand.view.prompt is not None
    hand.key(pygame.K_ESCAPE)
    hand.save_as(tmp_path / "other.toml", SHIFT)
    assert (tmp_path / "other.toml").read_text() == text
    assert hand.view.draft.path == tmp_path / "other.toml"


@pytest.mark.parametrize("name", ["", "\0", "x" * 300, "..", "~no-user/x", "no/such/folder/x", "a\ud800", "é.TOML"])
def test_every_name_is_saved_or_reported(hand: Hand, name: str) -> None:
    change(hand)
    hand.key(S, CTRL | SHIFT)
    prompt = hand.view.prompt
    assert prompt is not None
    prompt._edit.select_all()
    prompt._edit.insert(name)
    hand.key(pygame.K_RETURN)
    assert hand.view.prompt is None or prompt.note


@pytest.mark.parametrize(
    ("method", "fail", "message"),
    [("write_bytes", FULL, "No space left"), ("replace", DENIED, "Permission denied")],
    ids=["full disk", "read-only folder"],
)
def test_failure_to_save_is_reported_and_everything_stays(
    hand: Hand, monkeypatch: pytest.MonkeyPatch, method: str, fail: Callable[..., None], message: str
) -> None:
    text = change(hand)
    with monkeypatch.context() as patch:
        patch.setattr(Path, method, fail)
        hand.key(S, CTRL)
        assert message in hand.messages()
        assert (hand.path.read_text(), hand.view.draft.text, hand.view.draft.is_changed) == (BALL, text, True)
    assert not [each for each in hand.path.parent.iterdir() if each.suffix == ".tmp"]
    hand.key(S, CTRL)
    assert hand.path.read_text() == text


def test_unreadable_file_asks_before_it_is_replaced(hand: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    change(hand)
    monkeypatch.setattr(Path, "read_bytes", DENIED)
    hand.frame()
    hand.key(S, CTRL)
    assert hand.view.prompt is not None
    assert hand.path.read_text() == BALL


def test_ctrl_e_several_times_at_once_enters_and_leaves(open_on: OpenOn) -> None:
    hand = open_on(BALL, edits=False)
    for count in (1, 2, 3):
        is_edited = (hand.window.editing is not None) ^ bool(count % 2)
        hand.frame(*[key(E, CTRL), key_up(E)] * count)
        assert (hand.window.editing is not None) == is_edited


def test_held_keys_do_not_quit_or_leave(hand: Hand) -> None:
    hand.key(pygame.K_a, CTRL)
    assert hand.editor.selection
    for _ in range(6):  # key repeat
        hand.frame(key(pygame.K_ESCAPE))
    assert hand.window.context.exit_status is None
    assert not hand.editor.selection
    hand.frame(key_up(pygame.K_ESCAPE))
    for _ in range(6):
        hand.frame(key(E, CTRL))
        assert hand.window.editing is None


def test_leaving_while_a_field_is_edited_applies_it(open_on: OpenOn) -> None:
    hand = open_on(toml("ball", name="a", position=[0.0, 2.0], radius=0.5))
    hand.key(pygame.K_a, CTRL)
    box = hand.in_view(lambda: hand.view.panel.box_of("selection:ball", "mass"))
    hand.frame(press(*box.center), release(*box.center))
    hand.frame(pygame.event.Event(pygame.TEXTINPUT, text="0.25"))
    hand.key(E, CTRL)
    assert hand.window.editing is None
    assert hand.window.app_state.view is not None
    assert hand.window.app_state.view.scene.balls[0].mass == 0.25


@pytest.mark.parametrize(
    ("tool", "leave"),
    [*((tool, (E, CTRL)) for tool in ("select", "ball", "wall", "pivot", "thrust")), ("select", (pygame.K_F1, 0))],
)
def test_gesture_under_way_is_dropped_when_the_view_is_left(hand: Hand, tool: str, leave: tuple[int, int]) -> None:
    view, (x, y) = hand.view, hand.pixel(AT)
    view.editor.choose_tool(tool)
    hand.frame(press(x, y), move(x + 60, y + 40, held=True))
    text = view.draft.text
    hand.key(*leave)
    hand.frame(release(x + 60, y + 40))
    hand.key(*leave)
    assert hand.view is view
    for k in range(3):
        assert view.editor.gesture is None
        hand.frame(move(x + 40 * k, y + 40))
    assert view.draft.text == text


def test_scene_that_no_engine_can_run_stays_in_the_editor(open_on: OpenOn) -> None:
    hand = open_on(ATTRACTED)
    view = hand.view
    drive = toml("drive", kind="plunger", body="a", direction=[0, 1], travel=1.0, speed=1.0)
    view.draft.replace_text(ATTRACTED + drive, "add a drive")  # no engine models both
    for code, mod in ((E, CTRL), (pygame.K_SPACE, 0), (E, CTRL)):
        hand.key(code, mod)
        assert hand.window.editing is view
        assert "attraction and drives" in hand.messages()
    hand.key(S, CTRL)
    assert hand.path.read_text() == ATTRACTED + drive
    hand.key(Z, CTRL)
    hand.key(E, CTRL)
    assert hand.window.editing is None


@pytest.mark.parametrize(
    "name",
    ["artillery/duel", "games/landing", pytest.param("pinball/classic", marks=pytest.mark.nightly), "billiards/9-ball"],
)
def test_editor_on_a_game_that_runs(open_on: OpenOn, name: str) -> None:
    hand = open_on(find(name).read_text(), edits=False)
    hand.frame()
    for _ in range(2):
        hand.key(E, CTRL)
        for code in (pygame.K_LEFT, pygame.K_UP, pygame.K_DELETE, pygame.K_RETURN):
            hand.key(code)
        assert hand.view.draft.text == hand.path.read_text()
        hand.key(pygame.K_SPACE)
        assert hand.window.editing is None, "Space runs the scene"
        for _ in range(5):
            hand.frame()


def test_stored_run_is_not_edited(open_on: OpenOn) -> None:
    hand = open_on(BALL, edits=False)
    scene = load(hand.path)
    hand.window.app_state.show(RecordedView(RecordedRun(run(scene, "pymunk"))), None, scene)
    for _ in range(2):
        hand.key(E, CTRL)
        assert hand.window.editing is None
    assert "stored run" in hand.messages()


def test_typed_space_reaches_the_field_of_a_game_scene(open_on: OpenOn) -> None:
    hand = open_on(find("games/landing").read_text())
    assert hand.window.app_state.waits_for_start
    box = hand.in_view(lambda: hand.view.panel.box_of("scene", "title"))
    hand.frame(press(*box.center), release(*box.center))
    hand.frame(key(pygame.K_SPACE), pygame.event.Event(pygame.TEXTINPUT, text=" x"))
    assert hand.window.app_state.waits_for_start, "the game has started"
    assert hand.view.panel.has_focus


@pytest.mark.parametrize(
    ("code", "mod", "is_moved"),
    [
        (pygame.K_DELETE, 0, True),
        (pygame.K_DELETE, 0, False),
        (pygame.K_x, CTRL, True),
        (pygame.K_d, CTRL, True),
        (Z, CTRL, True),
        (pygame.K_LEFT, 0, True),
        (pygame.K_m, 0, False),
    ],
)
def test_change_during_a_drag_does_not_move_other_elements(
    open_on: OpenOn, code: int, mod: int, is_moved: bool
) -> None:
    balls = (("a", -2.0), ("b", 0.0), ("c", 2.0))
    hand = open_on("".join(toml("ball", name=name, position=[x, 2.0], radius=0.4) for name, x in balls))
    x, y = hand.pixel(AT)
    hand.frame(press(x, y))
    if is_moved:
        hand.frame(move(x + 50, y + 30, held=True))
        hand.frame(move(x + 60, y + 30, held=True))
    hand.key(code, mod)
    hand.frame(move(x + 90, y + 30, held=True))
    hand.frame(release(x + 90, y + 30))
    position = {ball.name: ball.position for ball in hand.scene.balls}
    assert (position["a"], position["c"]) == ((-2.0, 2.0), (2.0, 2.0))


def test_characters_of_altgr_and_system_shortcuts_are_no_commands(hand: Hand) -> None:
    hand.key(pygame.K_a, CTRL)
    for code in (E, pygame.K_x, pygame.K_m, pygame.K_d, pygame.K_SPACE, pygame.K_DELETE):
        for mod in (CTRL | pygame.KMOD_ALT, pygame.KMOD_META, pygame.KMOD_MODE):
            hand.key(code, mod)
    assert hand.window.editing is not None
    assert (hand.view.draft.text, hand.editor.tool) == (BALL, "select")


def test_shortcuts_work_on_a_cyrillic_keyboard(hand: Hand) -> None:
    change(hand)
    hand.frame(key(0x44F, CTRL, scancode=pygame.KSCAN_Z))
    assert hand.view.draft.text == BALL
    hand.frame(key(0x438, scancode=pygame.KSCAN_B))
    assert hand.editor.tool == "ball"
