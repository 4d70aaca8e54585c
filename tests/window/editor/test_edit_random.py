"""Edit mode under random input: no exception, no text that is not a scene, and undo to the first text."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pygame
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test

from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import FIELD_OF
from sandbox.scene.files.document import JOINTS
from sandbox.scene.files.load import loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.editor.edit_view import EditView
from sandbox.window.editor.toolbar import TOOLS, EditTool
from tests.toml_text import toml
from tests.window.editor.everything import ATTRACTED, EVERYTHING, TABLE
from tests.window.editor.hand import BALL, CTRL, SHIFT, Point
from tests.window.pressing import FOCUS_LOST, key, key_up, move, press, release, wheel

ALT, META = pygame.KMOD_ALT, pygame.KMOD_META
SKIPPED = (pygame.K_F11,)  # full screen is the display's
KEYS = [code for name in dir(pygame) if name.startswith("K_") and (code := getattr(pygame, name)) not in SKIPPED]
LIKELY = (
    *(ord(tool.key) for tool in TOOLS),
    *(pygame.K_RETURN, pygame.K_DELETE, pygame.K_BACKSPACE, pygame.K_m, pygame.K_TAB),
    *(pygame.K_LEFT, pygame.K_RIGHT, pygame.K_UP, pygame.K_DOWN, pygame.K_HOME),
)
WITH_CONTROL = tuple(map(ord, "zyxcvdaes"))
TEXTS = ("0.5", "-1", "1e9", "2x3", "1,2", "", " ", "x", ".", "-", "é", "\u202e", "\ud800", "👩‍👩‍👧", "\0", "9" * 400)
SIZES = (*((900, 600),) * 6, (1280, 720), (640, 480), (160, 120), (200, 700), (700, 130), (2, 2))
SCENES: dict[str, bytes | None] = {
    "new": None,
    "ball": BALL.encode(),
    "everything": EVERYTHING.encode(),
    "table": TABLE.encode(),
    "attracted": ATTRACTED.encode(),
    "line ends of Windows": ("\ufeff" + BALL.replace("\n", "\r\n")).encode(),
    "300 bodies": "".join(
        toml("ball", name=f"b{k}", position=[0.5 * (k % 20), 0.5 * (k // 20)], radius=0.2) for k in range(300)
    ).encode(),
    **{name: find(name).read_bytes() for name in ("billiards/9-ball", "tutorial/overpass")},
}

FRACTION = st.integers(0, 999).map(lambda k: k / 1000)
PLACES = ("body", "body", "handle", "scene", "scene", "scene", "window", "outside")
SPOTS = st.tuples(st.sampled_from(PLACES), FRACTION, FRACTION)
MODS = st.sampled_from((0, SHIFT, CTRL, SHIFT | CTRL, ALT))


def text_input(text: str) -> pygame.event.Event:
    return pygame.event.Event(pygame.TEXTINPUT, text=text)


def stroke(code: int, mod: int) -> tuple[pygame.event.Event, ...]:
    return key(code, mod), key_up(code)


EDITS = st.builds(stroke, st.sampled_from(WITH_CONTROL), st.sampled_from((CTRL, CTRL, CTRL | SHIFT)))
STROKES = st.one_of(
    st.builds(stroke, st.sampled_from(LIKELY), st.sampled_from((0, SHIFT))),
    EDITS,
    st.builds(stroke, st.sampled_from(KEYS), st.sampled_from((0, SHIFT, CTRL, ALT, META, CTRL | SHIFT, CTRL | ALT))),
    st.sampled_from(TEXTS).map(lambda text: (text_input(text),)),
    st.just((FOCUS_LOST,)),
)


def check(draft: SceneDraft) -> None:
    """Check that the text of a draft is its scene."""
    assert loads(draft.text) == draft.scene


class RandomUser(RuleBasedStateMachine):
    """A user who clicks, drags and types at random in an editor of a scene."""

    def __init__(self, content: bytes | None, ended: list[str]) -> None:
        super().__init__()
        self.ended = ended
        self.left, self.temporary = Path.cwd(), TemporaryDirectory()
        self.folder = Path(self.temporary.name)
        os.chdir(self.folder)
        self.window = App(AppState(), size=(900, 600), folder=self.folder, say=lambda _: None)
        if content is not None:
            (self.folder / "scene.toml").write_bytes(content)
            assert self.window.app_state.open(self.folder / "scene.toml"), self.window.app_state.faults
        pygame.event.clear()
        self.window.start_editing()
        self.frame()
        self.draft = self.view.draft
        self.original = self.draft.text

    @property
    def view(self) -> EditView:
        assert self.window.editing is not None, self.window.app_state.messages.visible()
        return self.window.editing

    def frame(self, *events: pygame.event.Event) -> None:
        for event in events:
            pygame.event.post(event)
        self.window.run_frame(0.02)

    def act(self, *events: pygame.event.Event, mods: int = 0) -> None:
        """Post events, run a frame, and return to the editor if they have left it."""
        pygame.key.set_mods(mods)
        self.frame(*events)
        pygame.key.set_mods(0)
        context = self.window.context
        context.exit_status, context.gui.scene_browser = None, None
        self.window.commands.confirmation.cancel()
        if context.gui.help.open:
            context.gui.toggle_help()
        if self.window.editing is None:
            self.frame()
            self.window.start_editing()
            self.frame()
        if self.draft.scene.surface is not None:  # shadows of billiard balls take memory by their area in px
            context.camera = context.camera.zoomed_to(min(context.camera.scale, 3e3))
        assert self.view.draft is self.draft

    def pixel(self, spot: tuple[str, float, float]) -> Point:
        """Return a position, px, within the range of pygame's events: at a body, at a handle, or anywhere."""
        (place, u, v), (width, height) = spot, self.window.context.surface.get_size()
        points = [handle.point for handle in self.view.editor.handles(self.view.view_scale)]
        if place == "body" or not points:
            points = self.draft.scene.bodies.position.tolist()
        if place in ("body", "handle") and points:
            point = np.asarray(points[min(int(u * len(points)), len(points) - 1)])
            x, y = self.window.context.camera.to_screen(point).tolist()
            x += 6.0 * v - 3.0
        else:
            if place == "scene":
                width, height = self.window.context.gui.area.size
            margin = 300 if place == "outside" else 0
            x, y = u * (width + 2 * margin) - margin, v * (height + 2 * margin) - margin
        return min(max(x, -30_000.0), 30_000.0), min(max(y, -30_000.0), 30_000.0)

    @rule(spot=SPOTS, mods=MODS, button=st.sampled_from((1, 1, 1, 2, 3, 4, 5, 8)), is_released=st.booleans())
    def click(self, spot: Any, mods: int, button: int, is_released: bool) -> None:
        x, y = self.pixel(spot)
        self.act(move(x, y), press(x, y, button), *[release(x, y, button)] * is_released, mods=mods)

    @rule(
        begin=SPOTS,
        end=SPOTS,
        mods=MODS,
        button=st.sampled_from((1, 1, 1, 3)),
        meanwhile=st.none() | STROKES,
        is_released=st.sampled_from((True, True, True, False)),
    )
    def drag(self, begin: Any, end: Any, mods: int, button: int, meanwhile: Any, is_released: bool) -> None:
        start, stop = self.pixel(begin), self.pixel(end)
        pygame.key.set_mods(mods)
        self.frame(move(*start), press(*start, button))
        self.frame(move(*stop, held=True), *(meanwhile or ()))
        self.act(*[release(*stop, button)] * is_released)

    @rule(events=STROKES)
    def type_key(self, events: tuple[pygame.event.Event, ...]) -> None:
        self.act(*events)

    @rule(tool=st.sampled_from(TOOLS), begin=SPOTS, end=SPOTS, clicks=st.booleans())
    def use_tool(self, tool: EditTool, begin: Any, end: Any, clicks: bool) -> None:
        """Choose a tool by its key, and click twice or drag."""
        self.act(key(ord(tool.key)), key_up(ord(tool.key)))
        for spot in (begin, end):
            if clicks:
                self.click(spot, 0, 1, True)
        if not clicks:
            self.drag(begin, end, 0, 1, None, True)

    @rule(first=EDITS, second=EDITS)
    def edit(self, first: Any, second: Any) -> None:
        self.act(*first, *second)

    @rule(
        at=FRACTION,
        button=st.sampled_from((1, 1, 1, 3)),
        text=st.sampled_from(TEXTS),
        last=st.sampled_from((pygame.K_RETURN, pygame.K_TAB, pygame.K_ESCAPE, pygame.K_DELETE)),
    )
    def fill_in(self, at: float, button: int, text: str, last: int) -> None:
        """Click a field of the panel that is in view, and type into it."""
        panel = self.view.panel
        boxes = [
            box
            for item in panel._visible_items()
            if item.row is not None and (box := panel.box_of(*item.row_id)) is not None
        ]
        if boxes:
            x, y = boxes[min(int(at * len(boxes)), len(boxes) - 1)].center
            self.frame(press(x, y, button), release(x, y, button))
            self.act(text_input(text), key(last))

    @rule(spot=SPOTS, notches=st.sampled_from((-30, -3, -1, 1, 3, 30)))
    def turn_wheel(self, spot: Any, notches: int) -> None:
        self.act(move(*self.pixel(spot)), wheel(notches))

    @rule(size=st.sampled_from(SIZES), scale=st.sampled_from((1.0, 1.0, 1.25, 2.0)))
    def resize(self, size: tuple[int, int], scale: float) -> None:
        self.window.context.gui.ui_scale = scale
        pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        pygame.display.set_mode(size, pygame.RESIZABLE)
        self.act()

    @precondition(lambda self: len(self.draft.scene.bodies) < 100)
    @rule()
    def check_text(self) -> None:
        check(self.draft)

    def teardown(self) -> None:
        try:
            self._check_end()
        finally:
            pygame.key.set_mods(0)
            self.window.close()
            os.chdir(self.left)
            self.temporary.cleanup()

    def _check_end(self) -> None:
        """Undo and redo everything, and save."""
        view, draft = self.view, self.draft
        view.prompt, view.editor.gesture = None, None
        view.panel.commit()
        check(draft)
        text, count = draft.text, 0
        while draft.undo() is not None:
            count += 1
        assert draft.text == self.original
        for _ in range(count):
            assert draft.redo() is not None
        assert draft.text == text
        saved = draft.save(self.folder / "saved.toml")
        assert loads(saved.read_text(encoding="utf-8-sig")) == draft.scene
        self.ended.append(text)


@pytest.mark.fail_slow(120)  # 120 inputs to a window; a frame of a scene with much in it takes 0.2 s
@pytest.mark.parametrize("name", SCENES)
def test_random_input_keeps_a_valid_scene_and_its_history(name: str) -> None:
    ended: list[str] = []
    run_state_machine_as_test(
        lambda: RandomUser(SCENES[name], ended),
        settings=settings(max_examples=4, stateful_step_count=30, suppress_health_check=list(HealthCheck)),
    )
    assert ended  # the checks at the end were made


def test_scenes_of_random_input_have_every_kind_of_element() -> None:
    found = [loads(text) for text in (EVERYTHING, TABLE, ATTRACTED)]
    for table, name in FIELD_OF.items():
        assert any(getattr(scene, name) for scene in found), table
    kinds = set(JOINTS) - {"pin"}  # which is another name of a rod
    assert {joint.kind for scene in found for joint in scene.joints} == kinds
