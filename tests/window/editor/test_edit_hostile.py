"""Edit mode under random input, hostile files and unusual scenes: no exception, and no text that is not a scene."""

import random
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import FIELD_OF
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import JOINTS
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.editor.edit_view import EditView
from sandbox.window.editor.toolbar import TOOLS
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from tests.window.pressing import FOCUS_LOST, key, key_up, move, press, release, wheel

pytestmark = pytest.mark.full  # windows and long sequences

CTRL, SHIFT, ALT, META = pygame.KMOD_CTRL, pygame.KMOD_SHIFT, pygame.KMOD_ALT, pygame.KMOD_META
Point = tuple[float, float]

BALL = """# one ball
[[ball]]
name = "a"
position = [0.0, 2.0]  # above
radius = 0.5
"""

EVERYTHING = """#:schema ../scene.schema.json
# every kind of element
title = "Everything"
[world]
gravity = [0.0, -9.81]
duration = 2.0

[[material]]
name = "wood"
friction = 0.4
[[material]]
name = "steel"
[[pair]]
between = ["wood", "steel"]
friction = 0.1

[[plane]]
name = "ground"
point = [0, -5]
normal = [0.0, 1.0]
[[wall]]
name = "lane"
points = [[-8, 0], [-7, -1.0], [-6, 0]]  # open
thickness = 0.1
material = "wood"
[[wall]]
points = [[-8, 3], [-7, 3], [-7.5, 4]]
closed = true
one_way = false
[[post]]
position = [-5.0, 1.0]
radius = 0.2
[[zone]]
name = "round"
position = [-5.0, 3.0]
radius = 0.4
gravity = [1.0, 1.0]
[[zone]]
points = [[-9, 5], [-8, 5], [-8, 6]]
to_layer = "ramp"
[[zone]]
points = [[-9, 7], [-8, 7], [-8, 8]]
thickness = 0.3
layers = ["ramp"]

[[ball]]
name = "a"
position = [0.0, 3.0]
radius = 0.5
[[ball]]
name = '7 "b"'
position = [ 2.0, 3.0 ] # m
radius = 5e-1
material = "steel"
[[ball]]
position = [4.0, 3.0]
radius = 0.5
[[box]]
name = "c"
position = [6.0, 3.0]
size = [1, 1]
angle = 0.3
[[box]]
name = "anchor"
position = [6.0, 5.0]
size = [1, 1]
fixed = true
[[capsule]]
name = "bat"
position = [8.0, 3.0]
length = 1.0
radius = 0.1
[[capsule]]
name = "pin"
position = [8.0, 5.0]
length = 0.5
radius = 0.1
angle = 1.5
[[polygon]]
name = "tri"
position = [8.0, 7.0]
points = [[0, 0], [1, 0], [0, 1]]
[[polygon]]
position = [6.0, 7.0]
angle = 0.5
points = [[0, 0], [1, 0], [1, 1], [0, 1]]
[[body]]
name = "ship"
position = [4.0, 7.0]
mass = 1.0
[[body.polygon]]
points = [[-0.5, -0.5], [0.5, -0.5], [0, 0.5]]
[[body.ball]]
position = [0, 0.6]
radius = 0.2
[[body.box]]
position = [0.0, -0.6]
size = [0.3, 0.2]
angle = 0.2
[[body.capsule]]
position = [0.5, 0.0]
length = 0.3
radius = 0.1
[[grid]]
name = "g"
origin = [-3, 5]
columns = 3
rows = 2
spacing = [0.5, 0.5]
radius = 0.2
[[scatter]]
lower = [-3, 7]
upper = [0, 9]
count = 4
radius = 0.2
[[emitter]]
position = [1, 6]
count = 5
velocity_min = [-1, -1]
velocity_max = [1, 1]
lifetime = 0.5
[[stack]]
base = [-4.0, -4.0]
columns = 2
rows = 3
size = [0.5, 0.5]
[[rope]]
name = "line"
start = [0.0, 5.0]
end = [2.0, 5.0]
links = 4
tie = { start = "a" }
[[rope]]
start = [0.0, -1.0]
end = [2.0, -1.0]
links = 3
kind = "planks"
[[cloth]]
corner = [2, 0]
columns = 3
rows = 3
spacing = [0.4, 0.4]
stiffness = 90.0
bend = 1.0
[[ragdoll]]
position = [5.0, -1.0]
height = 1.8

[[joint]]
name = "rod"
kind = "rod"
between = ["a", "c"]
length = 6.0
[[joint]]
kind = "rod"
between = ["a"]
anchors = [[0, 0], [0, 5]]
[[joint]]
kind = "pivot"
between = ["a", '7 "b"']
at = [1.0, 3.0]
[[joint]]
kind = "pivot"
between = ["c", "tri"]
anchors = [[1.0, 2.0], [-1.0, -2.0]]
[[joint]]
kind = "pivot"
between = ["ship"]
at = [4.0, 7.0]
[[joint]]
kind = "slide"
between = ["a", "ship"]
least = 0.5
most = 9.0
[[joint]]
kind = "groove"
between = ["a", "c"]
groove = [[0, 0], [1, 0]]
[[joint]]
kind = "groove"
between = ["tri"]
groove = [[8, 7], [9, 7]]
[[joint]]
kind = "rotary_limit"
between = ["a", "c"]
least = -1
most = 1
[[joint]]
kind = "motor"
between = ["c"]
rate = 1.0
[[joint]]
kind = "gear"
between = ["a", "c"]
ratio = 2.0
[[joint]]
kind = "spring"
between = ["ball-3", "c"]
anchors = [[0.1, 0], [0, 0.2]]
stiffness = 10.0
[[joint]]
kind = "rotary_spring"
between = ["a", "tri"]
stiffness = 10.0
max_force = 3.0
[[joint]]
kind = "ratchet"
between = ["a", "tri"]
ratchet = 0.5
max_force = 3.0
max_bias = 1.0
bias = 0.1
[[thrust]]
name = "engine"
body = "ship"
force = [0.0, 5.0]
point = [0.0, -0.3]
key = "up"
[[drive]]
name = "flip"
kind = "stroke"
body = "bat"
pivot = [7.5, 3.0]
stops = [0.0, 1.0]
rate = 1.0
key = "left"
[[drive]]
name = "plunger"
kind = "plunger"
body = "pin"
direction = [0, 1]
travel = 1.0
speed = 1.0
key = "space"
"""

ATTRACTED = """[[ball]]
name = "a"
position = [0.0, 3.0]
radius = 0.5
[[ball]]
name = "b"
position = [2.0, 3.0]
radius = 0.5
[[joint]]
kind = "pulley"
between = ["a", "b"]
wheels = [[0.0, 9.0], [6.0, 9.0]]
[[attraction]]
toward = [0.0, 3.0]
strength = 1.0
[[attraction]]
toward = "a"
strength = 1.0
"""

NO_ENGINE = (
    ATTRACTED
    + """[[drive]]
kind = "plunger"
body = "a"
direction = [0, 1]
travel = 1.0
speed = 1.0
"""
)
"""No engine models attraction and drives together."""

TABLE = """title = "Table"
world = { gravity = [0.0, 0.0] }
surface = { sliding_friction = 0.2, rolling_friction = 0.01 }

[[ball]]
name = "cue"
position = [-0.5, 0.0]
radius = 0.03
[[ball]]
position = [0.5, 0.0]
radius = 0.03
[[pocket]]
position = [1.1, 0.6]
radius = 0.06
[[wall]]
points = [[-1.2, -0.7], [1.2, -0.7], [1.2, 0.7], [-1.2, 0.7]]
closed = true
height = 0.04
[[shot]]
ball = "cue"
speed = 1.0
aim = 0.1
"""

CRLF = "\ufeff" + BALL.replace("\n", "\r\n")

CROWD = "".join(
    f'[[ball]]\nname = "b{k}"\nposition = [{0.5 * (k % 20)}, {0.5 * (k // 20)}]\nradius = 0.2\n' for k in range(300)
)

SHIPPED = ("billiards/9-ball", "artillery/duel", "tutorial/overpass")


class MonkeyUser:
    """Random input to a window with an editor, reproducible by its seed."""

    KEYS = tuple(getattr(pygame, name) for name in dir(pygame) if name.startswith("K_"))
    LIKELY = (
        *(ord(tool.key) for tool in TOOLS),
        *(pygame.K_RETURN, pygame.K_DELETE, pygame.K_BACKSPACE, pygame.K_m, pygame.K_TAB),
        *(pygame.K_LEFT, pygame.K_RIGHT, pygame.K_UP, pygame.K_DOWN, pygame.K_HOME),
    )
    WITH_CONTROL = (
        *(pygame.K_z, pygame.K_y, pygame.K_x, pygame.K_c, pygame.K_v, pygame.K_v, pygame.K_d, pygame.K_a),
        *(pygame.K_e, pygame.K_s),
    )
    TEXTS = (
        "0.5",
        "-1",
        "1e9",
        "2x3",
        "1,2",
        "",
        " ",
        "x",
        ".",
        "-",
        "é",
        "\u202e",
        "\ud800",
        "👩‍👩‍👧",
        "\0",
        "9" * 400,
    )
    SIZES = ((640, 480), (160, 120), (200, 700), (700, 130), (2, 2), (1280, 720))
    SKIPPED = (pygame.K_F11,)  # full screen is the display's

    def __init__(self, window: App, seed: int) -> None:
        self.window, self.random = window, random.Random(seed)
        self.log: list[str] = []

    def act(self) -> None:
        """Post one to a few random events, and run a frame."""
        actions: tuple[tuple[Callable[[], None], int], ...] = (
            (self.click, 6),
            (self.drag, 6),
            (self.likely_key, 5),
            (self.control_key, 6),
            (self.any_key, 3),
            (self.text, 3),
            (self.field, 4),
            (self.wheel, 1),
            (self.lose_focus, 1),
            (self.resize, 1),
            (self.scale, 1),
        )
        (action,) = self.random.choices([each for each, _ in actions], [weight for _, weight in actions])
        self.log.append(action.__name__)
        action()
        self.frame()
        pygame.key.set_mods(0)
        self.withdraw()

    def withdraw(self) -> None:
        """Return to the editor if the random input has left it, and never quit."""
        window = self.window
        window.context.exit_status = None
        window.commands.cancel_confirmation()
        if window.context.gui.help.open:
            window.context.gui.toggle_help()
        window.context.gui.scene_browser = None
        if window.editing is None:
            self.frame()
            window.start_editing()
            self.frame()
        assert window.editing is not None, window.app_state.messages.visible()
        if window.editing.draft.scene.surface is not None:  # shadows of billiard balls take memory by their area in px
            window.context.camera = window.context.camera.zoomed_to(min(window.context.camera.scale, 3e3))

    def frame(self) -> None:
        self.window.run_frame(0.02)

    def point(self) -> Point:
        """Return a random position, px: often at an element or handle, sometimes outside the window."""
        width, height = self.window.context.surface.get_size()
        editing = self.window.editing
        kind = self.random.random()
        if editing is not None and kind < 0.3 and len(editing.draft.scene.bodies):
            position = editing.draft.scene.bodies.position
            at = position[self.random.randrange(len(position))]
            x, y = self.window.context.camera.to_screen(at).tolist()
            return x + self.random.choice((0, 0, 3, -5)), y
        if editing is not None and kind < 0.5:
            handles = editing.editor.handles(editing.view_scale)
            if handles:
                x, y = self.window.context.camera.to_screen(np.asarray(self.random.choice(handles).point)).tolist()
                return x, y
        margin = 0 if kind < 0.9 else 300
        return self.random.uniform(-margin, width + margin), self.random.uniform(-margin, height + margin)

    def post(self, *events: pygame.event.Event) -> None:
        for event in events:
            pygame.event.post(event)

    def modify(self) -> int:
        mods = self.random.choice((0, 0, 0, SHIFT, CTRL, SHIFT | CTRL, ALT))
        pygame.key.set_mods(mods)
        return mods

    def click(self) -> None:
        x, y = _clamped(self.point())
        self.modify()
        button = self.random.choice((1, 1, 1, 1, 2, 3, 4, 5, 8))
        self.post(move(x, y), press(x, y, button))
        if self.random.random() < 0.9:
            self.post(release(x, y, button))

    def drag(self) -> None:
        (x, y), end = _clamped(self.point()), _clamped(self.point())
        self.modify()
        button = self.random.choice((1, 1, 1, 1, 3))
        self.post(move(x, y), press(x, y, button))
        self.frame()
        self.post(move(*end, held=True))
        if self.random.random() < 0.3:
            self.frame()
            self.random.choice((self.text, self.any_key, self.control_key, self.lose_focus))()
        if self.random.random() < 0.9:
            self.post(release(*end, button))

    def likely_key(self) -> None:
        code = self.random.choice(self.LIKELY)
        self.post(key(code, self.modify() & SHIFT), key_up(code))

    def control_key(self) -> None:
        code = self.random.choice(self.WITH_CONTROL)
        mods = CTRL | self.random.choice((0, 0, SHIFT))
        self.post(key(code, mods), key_up(code))

    def any_key(self) -> None:
        code = self.random.choice(self.KEYS)
        if code not in self.SKIPPED:
            self.post(
                key(code, self.random.choice((0, SHIFT, CTRL, ALT, META, CTRL | SHIFT, CTRL | ALT))), key_up(code)
            )

    def text(self) -> None:
        self.post(pygame.event.Event(pygame.TEXTINPUT, text=self.random.choice(self.TEXTS)))

    def field(self) -> None:
        """Click a field of the panel that is in view, and type into it."""
        editing = self.window.editing
        if editing is None:
            return
        boxes = [
            box
            for item in editing.panel._visible_items()
            if item.row is not None and (box := editing.panel.box_of(*item.row_id)) is not None
        ]
        if not boxes:
            return
        x, y = self.random.choice(boxes).center
        button = self.random.choice((1, 1, 1, 3))
        self.post(press(x, y, button), release(x, y, button))
        self.frame()
        if self.random.random() < 0.7:
            self.text()
            self.post(key(self.random.choice((pygame.K_RETURN, pygame.K_TAB, pygame.K_ESCAPE, pygame.K_DELETE))))

    def wheel(self) -> None:
        self.post(move(*_clamped(self.point())), wheel(self.random.choice((-30, -3, -1, 1, 3, 30))))

    def lose_focus(self) -> None:
        self.post(FOCUS_LOST)

    def resize(self) -> None:
        size = self.random.choice(self.SIZES)
        self.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        pygame.display.set_mode(size, pygame.RESIZABLE)

    def scale(self) -> None:
        self.window.context.gui.ui_scale = self.random.choice((1.0, 1.0, 1.25, 2.0))


def _clamped(point: Point) -> Point:
    """Return a position within the range of pygame's events, px."""
    return min(max(point[0], -30_000.0), 30_000.0), min(max(point[1], -30_000.0), 30_000.0)


@pytest.fixture
def open_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., App]]:
    """Return a function that opens a window on a scene file and edits it; without a file, a new scene."""
    monkeypatch.chdir(tmp_path)
    windows: list[App] = []

    def edit(path: Path | None, scale: float = 1.0, edits: bool = True) -> App:
        window = App(AppState(), size=(900, 600), folder=tmp_path, say=lambda _: None)
        window.context.gui.ui_scale = scale
        windows.append(window)
        assert path is None or window.app_state.open(path), window.app_state.faults
        pygame.event.clear()
        if edits:
            window.start_editing()
            window.run_frame(0.02)
            assert window.editing is not None
        return window

    yield edit
    pygame.key.set_mods(0)
    for window in windows:
        window.close()


def view_of(window: App) -> EditView:
    assert window.editing is not None
    return window.editing


def type_key(window: App, code: int, mod: int = 0) -> None:
    pygame.event.post(key(code, mod))
    pygame.event.post(key_up(code))
    window.run_frame(0.02)


def messages(window: App) -> str:
    return " ".join(text for _, text in window.app_state.messages.visible())


def check(draft: SceneDraft) -> None:
    """Check that the text of a draft is its scene."""
    assert loads(draft.text) == draft.scene


def check_history(draft: SceneDraft, original: str) -> None:
    """Undo everything, which must restore the original, and redo it."""
    text, count = draft.text, 0
    while draft.undo() is not None:
        count += 1
    assert draft.text == original
    for _ in range(count):
        assert draft.redo() is not None
    assert draft.text == text


def run_random_input(window: App, seed: int, count: int) -> None:
    user, draft = MonkeyUser(window, seed), view_of(window).draft
    original = draft.text
    for k in range(count):
        user.act()
        assert view_of(window).draft is draft
        if k % 20 == 19:
            check(draft)
    view = view_of(window)
    view.prompt = None
    view.panel.commit()
    view.editor.gesture = None
    check(view.draft)
    check_history(view.draft, original)
    saved = view.draft.save(Path("saved.toml"))
    assert loads(saved.read_text(encoding="utf-8-sig")) == view.draft.scene


SCENES = {"ball": BALL, "everything": EVERYTHING, "table": TABLE, "attracted": ATTRACTED, "crlf": CRLF}


def test_scene_with_everything_has_every_kind_of_element() -> None:
    found = [loads(text) for text in (EVERYTHING, TABLE, ATTRACTED)]
    for table, name in FIELD_OF.items():
        assert any(getattr(scene, name) for scene in found), table
    kinds = set(JOINTS) - {"pin"}  # which is another name of a rod
    assert {joint.kind for scene in found for joint in scene.joints} == kinds


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", SCENES)
def test_random_input_to_a_scene(open_on: Callable[..., App], tmp_path: Path, name: str, seed: int) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(SCENES[name].encode())
    run_random_input(open_on(path, 1.0 + seed % 2), seed, 30 if name == "everything" else 60)


@pytest.mark.parametrize("seed", range(3))
def test_random_input_to_a_new_scene(open_on: Callable[..., App], seed: int) -> None:
    run_random_input(open_on(None, 1.0 + seed % 2), seed, 80)


@pytest.mark.parametrize("name", SHIPPED)
def test_random_input_to_a_shipped_scene(open_on: Callable[..., App], tmp_path: Path, name: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(find(name).read_bytes())
    run_random_input(open_on(path), 1, 30)


def test_random_input_to_300_bodies(open_on: Callable[..., App], tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(CROWD)
    run_random_input(open_on(path), 2, 25)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(BALL)
    return path


def change(window: App, x: float = 1.0) -> str:
    """Move the ball of the draft; return the new text."""
    draft = view_of(window).draft
    draft.replace_text(draft.text.replace("[0.0, 2.0]", f"[{x}, 2.0]"), "move")
    return draft.text


def save_as(window: App, path: Path) -> None:
    """Save under another name by the prompt."""
    type_key(window, pygame.K_s, CTRL | SHIFT)
    assert view_of(window).prompt is not None
    type_key(window, pygame.K_a, CTRL)
    pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text=str(path)))
    type_key(window, pygame.K_RETURN)


def test_deleted_file_is_written_again_only_after_a_question(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    text = change(window)
    path.unlink()
    type_key(window, pygame.K_e, CTRL)
    type_key(window, pygame.K_e, CTRL)
    assert view_of(window).draft.text == text
    type_key(window, pygame.K_s, CTRL)
    prompt = view_of(window).prompt
    assert prompt is not None
    assert prompt.note
    assert not path.exists()
    type_key(window, pygame.K_RETURN)
    assert view_of(window).prompt is None
    assert path.read_text() == text


def test_unchanged_draft_of_a_deleted_or_faulty_file_stays(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    for spoil in (path.unlink, lambda: path.write_text("not a scene"), lambda: path.write_bytes(b"\xff")):
        spoil()
        type_key(window, pygame.K_e, CTRL)
        type_key(window, pygame.K_e, CTRL)
        assert view_of(window).draft.text == BALL


def test_file_that_became_a_folder_can_be_saved_elsewhere(
    open_on: Callable[..., App], path: Path, tmp_path: Path
) -> None:
    window = open_on(path)
    text = change(window)
    path.unlink()
    path.mkdir()
    type_key(window, pygame.K_s, CTRL)
    for _ in range(3):
        type_key(window, pygame.K_RETURN)
    assert view_of(window).prompt is not None
    type_key(window, pygame.K_ESCAPE)
    save_as(window, tmp_path / "other.toml")
    assert (tmp_path / "other.toml").read_text() == text
    assert view_of(window).draft.path == tmp_path / "other.toml"


@pytest.mark.parametrize(
    "name", ["", " ", ".", "/", "\0", "x" * 300, "..", "~no-such-user/x", "no/such/folder/x", "a\ud800", "é.TOML"]
)
def test_every_name_is_saved_or_reported(open_on: Callable[..., App], path: Path, name: str) -> None:
    window = open_on(path)
    change(window)
    type_key(window, pygame.K_s, CTRL | SHIFT)
    prompt = view_of(window).prompt
    assert prompt is not None
    prompt._edit.select_all()
    prompt._edit.insert(name)
    type_key(window, pygame.K_RETURN)
    assert view_of(window).prompt is None or prompt.note


def test_full_disk_is_reported_and_everything_stays(
    open_on: Callable[..., App], path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Path, _data: bytes) -> int:
        raise OSError(28, "No space left on device", str(self))

    window = open_on(path)
    text = change(window)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        type_key(window, pygame.K_s, CTRL)
        assert "No space left" in messages(window)
        assert (path.read_text(), view_of(window).draft.text) == (BALL, text)
        assert view_of(window).draft.is_changed
    type_key(window, pygame.K_s, CTRL)
    assert path.read_text() == text


def test_read_only_folder_is_reported(open_on: Callable[..., App], path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, *_: object) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    window = open_on(path)
    change(window)
    monkeypatch.setattr(Path, "replace", refuse)
    type_key(window, pygame.K_s, CTRL)
    assert "Permission denied" in messages(window)
    assert path.read_text() == BALL
    assert {each.name for each in path.parent.iterdir()} == {"scene.toml"}


def test_unreadable_file_asks_before_it_is_replaced(
    open_on: Callable[..., App], path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(self: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(self))

    window = open_on(path)
    change(window)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    window.run_frame(0.02)
    type_key(window, pygame.K_s, CTRL)
    assert view_of(window).prompt is not None
    assert path.read_text() == BALL


def test_ctrl_e_twice_at_once_returns_to_the_editor(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path, edits=False)
    for count in (1, 2, 3, 4, 5):
        for _ in range(count):
            pygame.event.post(key(pygame.K_e, CTRL))
            pygame.event.post(key_up(pygame.K_e))
        is_edited = (window.editing is not None) ^ bool(count % 2)
        window.run_frame(0.02)
        assert (window.editing is not None) == is_edited


def test_held_keys_do_not_quit_or_leave(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    type_key(window, pygame.K_a, CTRL)
    assert view_of(window).editor.selection
    for _ in range(6):  # key repeat
        pygame.event.post(key(pygame.K_ESCAPE))
        window.run_frame(0.02)
    assert window.context.exit_status is None
    assert not view_of(window).editor.selection
    pygame.event.post(key_up(pygame.K_ESCAPE))
    window.run_frame(0.02)
    states = []
    for _ in range(6):
        pygame.event.post(key(pygame.K_e, CTRL))
        window.run_frame(0.02)
        states.append(window.editing is None)
    assert states == [True] * 6


def test_leaving_while_a_field_is_edited_applies_it(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    type_key(window, pygame.K_a, CTRL)
    window.run_frame(0.02)
    box = view_of(window).panel.box_of("selection:ball", "mass")
    assert box is not None
    pygame.event.post(press(*box.center))
    pygame.event.post(release(*box.center))
    window.run_frame(0.02)
    pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text="0.25"))
    type_key(window, pygame.K_e, CTRL)
    assert window.editing is None
    view = window.app_state.view
    assert view is not None
    assert view.scene.balls[0].mass == 0.25


@pytest.mark.parametrize("tool", [tool.name for tool in TOOLS])
def test_leaving_while_a_gesture_is_under_way_drops_it(open_on: Callable[..., App], path: Path, tool: str) -> None:
    window = open_on(path)
    view = view_of(window)
    at = window.context.camera.to_screen(np.asarray((0.0, 2.0))).tolist()
    view.editor.choose_tool(tool)
    pygame.event.post(press(*at))
    pygame.event.post(move(at[0] + 60, at[1] + 40, held=True))
    window.run_frame(0.02)
    text = view.draft.text
    type_key(window, pygame.K_e, CTRL)
    assert window.editing is None
    pygame.event.post(release(at[0] + 60, at[1] + 40))
    window.run_frame(0.02)
    type_key(window, pygame.K_e, CTRL)
    assert view_of(window) is view
    assert view.editor.gesture is None
    pygame.event.post(move(at[0] + 90, at[1] + 40))
    window.run_frame(0.02)
    assert view.draft.text == text
    assert view.editor.gesture is None


def test_scene_that_no_engine_can_run_stays_in_the_editor(open_on: Callable[..., App], path: Path) -> None:
    path.write_text(ATTRACTED)
    window = open_on(path)
    view = view_of(window)
    view.draft.replace_text(NO_ENGINE, "add a drive")
    for code, mod in ((pygame.K_e, CTRL), (pygame.K_SPACE, 0), (pygame.K_e, CTRL)):
        type_key(window, code, mod)
        assert window.editing is view
        assert "attraction and drives" in messages(window)
    type_key(window, pygame.K_s, CTRL)
    assert path.read_text() == NO_ENGINE
    type_key(window, pygame.K_z, CTRL)
    type_key(window, pygame.K_e, CTRL)
    assert window.editing is None


@pytest.mark.parametrize("name", ["artillery/duel", "pinball/classic", "billiards/9-ball", "games/landing"])
def test_editor_on_a_game_that_runs(open_on: Callable[..., App], tmp_path: Path, name: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(find(name).read_bytes())
    window = open_on(path, edits=False)
    for _ in range(5):
        window.run_frame(0.05)
    for _ in range(2):
        type_key(window, pygame.K_e, CTRL)
        assert window.editing is not None
        for code in (pygame.K_LEFT, pygame.K_UP, pygame.K_DELETE, pygame.K_RETURN):
            type_key(window, code)
        assert view_of(window).draft.text == path.read_text()
        type_key(window, pygame.K_SPACE)
        assert window.editing is None, "Space runs the scene"
        for _ in range(5):
            window.run_frame(0.05)


def test_stored_run_is_not_edited(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path, edits=False)
    found = run(load(path), "pymunk")
    window.app_state.show(RecordedView(RecordedRun(found)), None, load(path))
    for _ in range(2):
        type_key(window, pygame.K_e, CTRL)
        assert window.editing is None
    assert "stored run" in messages(window)


def test_typed_space_and_letters_reach_the_field_of_a_game_scene(open_on: Callable[..., App], tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(find("games/landing").read_bytes())
    window = open_on(path)
    assert window.app_state.waits_for_start
    box = view_of(window).panel.box_of("scene", "title")
    assert box is not None
    pygame.event.post(press(*box.center))
    pygame.event.post(release(*box.center))
    window.run_frame(0.02)
    pygame.event.post(key(pygame.K_SPACE))
    pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text=" x"))
    window.run_frame(0.02)
    assert window.app_state.waits_for_start, "the game has started"
    assert view_of(window).panel.has_focus


def test_faulty_draft_is_never_kept(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    draft = view_of(window).draft
    for text in ("", "[[ball]]", "\0", "x = 1", BALL + BALL, "[" * 5000):
        before = draft.text
        try:
            draft.replace_text(text, "spoil")
        except SceneError:
            assert draft.text == before
        check(draft)


THREE_BALLS = "".join(
    f'[[ball]]\nname = "{name}"\nposition = [{x}, 2.0]\nradius = 0.4\n'
    for name, x in (("a", -2.0), ("b", 0.0), ("c", 2.0))
)


@pytest.mark.parametrize("is_moved", [False, True])
@pytest.mark.parametrize(
    ("code", "mod"),
    [
        (pygame.K_DELETE, 0),
        (pygame.K_x, CTRL),
        (pygame.K_d, CTRL),
        (pygame.K_z, CTRL),
        (pygame.K_LEFT, 0),
        (pygame.K_m, 0),
    ],
)
def test_change_during_a_drag_does_not_move_other_elements(
    open_on: Callable[..., App], path: Path, code: int, mod: int, is_moved: bool
) -> None:
    path.write_text(THREE_BALLS)
    window = open_on(path)
    x, y = window.context.camera.to_screen(np.asarray((0.0, 2.0))).tolist()
    for position in ((x, y), (x + 50, y + 30), (x + 60, y + 30)):
        pygame.event.post(press(x, y) if position == (x, y) else move(*position, held=True))
        window.run_frame(0.02)
        if not is_moved:
            break
    type_key(window, code, mod)
    for event in (move(x + 90, y + 30, held=True), release(x + 90, y + 30)):
        pygame.event.post(event)
        window.run_frame(0.02)
    balls = {ball.name: ball.position for ball in view_of(window).draft.scene.balls}
    assert (balls["a"], balls["c"]) == ((-2.0, 2.0), (2.0, 2.0))
    window.run_frame(0.02)
    type_key(window, pygame.K_RIGHT)
    check(view_of(window).draft)


@pytest.mark.parametrize("leave", [(pygame.K_e, CTRL), (pygame.K_F1, 0)])
def test_press_does_not_outlast_the_view(open_on: Callable[..., App], path: Path, leave: tuple[int, int]) -> None:
    window = open_on(path)
    x, y = window.context.camera.to_screen(np.asarray((0.0, 2.0))).tolist()
    pygame.event.post(press(x, y))
    window.run_frame(0.02)
    type_key(window, *leave)
    pygame.event.post(release(x, y))
    window.run_frame(0.02)
    type_key(window, *leave)
    for k in range(3):
        pygame.event.post(move(x + 40 * k, y))
        window.run_frame(0.02)
    assert view_of(window).editor.gesture is None
    assert view_of(window).draft.text == BALL


def test_characters_of_altgr_and_system_shortcuts_are_no_commands(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    type_key(window, pygame.K_a, CTRL)
    for code in (pygame.K_e, pygame.K_x, pygame.K_m, pygame.K_d, pygame.K_SPACE, pygame.K_DELETE):
        for mod in (CTRL | ALT, META, pygame.KMOD_MODE):
            type_key(window, code, mod)
    assert window.editing is not None
    assert (view_of(window).draft.text, view_of(window).editor.tool) == (BALL, "select")


def test_shortcuts_work_on_a_cyrillic_keyboard(open_on: Callable[..., App], path: Path) -> None:
    window = open_on(path)
    change(window)
    pygame.event.post(key(0x44F, CTRL, scancode=pygame.KSCAN_Z))
    window.run_frame(0.02)
    assert view_of(window).draft.text == BALL
    pygame.event.post(key(0x438, scancode=pygame.KSCAN_B))
    window.run_frame(0.02)
    assert view_of(window).editor.tool == "ball"
