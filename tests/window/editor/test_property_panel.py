"""Property panel: editing of fields by mouse and keyboard, errors, folding, scrolling and cached drawing."""

from collections.abc import Callable, Mapping
from typing import Any

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.world import Settings, World
from sandbox.scene.editing.fields import fields_of
from sandbox.window.editor import property_panel
from sandbox.window.editor.property_panel import PropertyPanel
from sandbox.window.editor.property_rows import PropertyRow, PropertySection
from sandbox.window.render.palette import WARNING
from sandbox.window.ui.panel import SidePanel
from tests.window.pressing import FOCUS_LOST, key, move, press, release, wheel

SIZE = (1280, 900)  # a ball has 27 fields
BALL = {"name": "cue", "position": [0.0, 1.5], "radius": 0.05, "restitution": 0.8}
TYPED_OF_BALL = [
    "name", "material", "restitution", "restitution_falloff", "friction", "rolling_resistance", "surface_speed",
    "surface_velocity", "colour", "categories", "mask", "mass", "density", "angle", "angular_velocity", "gravity_scale",
    "linear_damping", "angular_damping", "max_speed", "max_angular_velocity", "layer", "position", "velocity", "moment",
    "lift", "group", "radius", "spin",
]  # fmt: skip


def section(
    model: type[BaseModel],
    values: Mapping[str, Any],
    title: str = "ball cue",
    mixed: tuple[str, ...] = (),
    is_open: bool = True,
) -> PropertySection:
    shown = [spec for spec in fields_of(model) if spec.key != "one_way" and not spec.key.startswith("path.")]
    rows = tuple(PropertyRow(spec, values.get(spec.key), spec.key in mixed) for spec in shown)
    return PropertySection(title, model.__name__.lower(), rows, is_open)


def text_input(text: str) -> pygame.event.Event:
    return pygame.event.Event(pygame.TEXTINPUT, text=text)


class Edited:
    """A panel that shows a ball and records its changes."""

    def __init__(self, *sections: PropertySection, size: tuple[int, int] = SIZE, ui_scale: float = 1.0) -> None:
        self.changes: list[tuple[str, str, Any]] = []
        self.error: str | None = None
        self.panel = PropertyPanel(size, ui_scale)
        self.panel.on_change = self._change
        self.panel.show(sections or (section(Ball, BALL),))

    def _change(self, of: str, field: str, value: Any) -> str | None:
        self.changes.append((of, field, value))
        return self.error

    def send(self, *events: pygame.event.Event) -> list[bool]:
        return [self.panel.handle_event(event) for event in events]

    def box(self, field: str, of: str = "ball") -> pygame.Rect:
        box = self.panel.box_of(of, field)
        assert box is not None
        return box

    def click(self, field: str, of: str = "ball", button: int = 1) -> None:
        x, y = self.box(field, of).center
        assert 0 <= y < self.panel.size[1], "out of view"
        assert self.send(move(x, y), press(x, y, button), release(x, y, button)) == [True, True, True]

    def click_heading(self, of: str, button: int = 1) -> None:
        heading = self.panel.heading_of(of)
        assert heading is not None
        self.send(move(*heading.center), press(*heading.center, button), release(*heading.center, button))

    def type(self, text: str) -> None:
        """Type text as SDL reports it: a key and a text event for each character."""
        for letter in text:
            assert self.send(key(ord(letter), unicode=letter), text_input(letter)) == [True, True]

    def enter(self, field: str, text: str, of: str = "ball") -> None:
        self.click(field, of)
        self.type(text)
        self.send(key(pygame.K_RETURN))

    def picture(self) -> bytes:
        surface = pygame.Surface(self.panel.size)
        self.panel.draw(surface)
        return pygame.image.tobytes(surface, "RGB")

    @property
    def focus(self) -> str | None:
        return None if self.panel.focused is None else self.panel.focused.field


def test_width_is_that_of_the_side_panel() -> None:
    for size, ui_scale in ((SIZE, 1.0), (SIZE, 2.0), ((2560, 1440), 2.0)):
        assert PropertyPanel(size, ui_scale).width == SidePanel(size, ui_scale).width


@pytest.mark.parametrize(
    ("field", "text", "changes"),
    [
        ("radius", "1/4", [0.25]),
        ("position", "1, 2", [[1.0, 2.0]]),
        ("mass", "2", [2.0]),
        ("name", "eight", ["eight"]),
        ("colour", "#ff8000", ["#ff8000"]),
        ("spin", "1, 2, 3", [[1.0, 2.0, 3.0]]),
        ("restitution", "\b", [None]),  # an empty text removes the key
        ("radius", "", []),  # the same value is no change
        ("radius", "5e-2", []),
    ],
)
def test_typed_text_replaces_the_value_when_enter_applies_it(field: str, text: str, changes: list[Any]) -> None:
    edited = Edited()
    edited.click(field)
    assert edited.panel.has_focus
    if text == "\b":
        edited.send(key(pygame.K_BACKSPACE))
    else:
        edited.type(text)
    assert not edited.changes
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", field, value) for value in changes]
    assert not edited.panel.has_focus


WAYS_TO_APPLY: dict[str, Callable[[Edited], object]] = {
    "click in the scene": lambda edited: edited.send(press(100, 100), release(100, 100)) == [False, False],
    "click in the panel": lambda edited: edited.send(press(1270, 715), release(1270, 715)) == [True, True],
    "click on another field": lambda edited: edited.click("mass") or edited.focus == "mass",
    "tab": lambda edited: edited.send(key(pygame.K_TAB)) and edited.focus == "spin",
    "folding": lambda edited: edited.click_heading("ball") or edited.focus is None,
    "commit": lambda edited: edited.panel.commit() or edited.panel.commit() or edited.focus is None,
    "loss of focus, which keeps it": lambda edited: edited.send(FOCUS_LOST, key(pygame.K_RETURN)),
}


@pytest.mark.parametrize("way", WAYS_TO_APPLY)
def test_edited_text_is_applied_once(way: str) -> None:
    edited = Edited()
    edited.click("radius")
    edited.type("2")
    assert WAYS_TO_APPLY[way](edited)
    assert edited.changes == [("ball", "radius", 2.0)]


def test_escape_cancels() -> None:
    edited = Edited()
    edited.click("radius")
    edited.type("7")
    assert edited.send(key(pygame.K_ESCAPE)) == [True]
    assert not edited.panel.has_focus and not edited.changes
    assert edited.send(key(pygame.K_ESCAPE)) == [False]


def test_tab_applies_and_visits_the_fields_in_order() -> None:
    edited = Edited()
    edited.click("name")
    visited = []
    for _ in TYPED_OF_BALL:
        visited.append(edited.focus)
        edited.send(key(pygame.K_TAB))
    assert visited == TYPED_OF_BALL
    assert edited.focus == "name"
    edited.send(key(pygame.K_TAB, pygame.KMOD_SHIFT))
    assert edited.focus == "spin"
    edited.type("0, 0, 1")
    edited.send(key(pygame.K_TAB, pygame.KMOD_SHIFT))
    assert edited.focus == "radius"
    assert edited.changes == [("ball", "spin", [0.0, 0.0, 1.0])]


def test_tab_leads_to_other_sections_but_not_into_folded_ones() -> None:
    edited = Edited(section(World, {}), section(Settings, {}, is_open=False), section(Ball, BALL))
    edited.click("bounds", "world")
    edited.send(key(pygame.K_TAB))
    assert edited.panel.focused == ("ball", "name")


def test_tab_scrolls_to_the_field() -> None:
    edited = Edited(section(Ball, BALL), section(Settings, {}), size=(1280, 300))
    edited.click("name")
    edited.send(key(pygame.K_TAB, pygame.KMOD_SHIFT))
    assert edited.focus == "record_every"
    assert 0 <= edited.box("record_every", "settings").top < edited.box("record_every", "settings").bottom <= 300
    edited.send(key(pygame.K_TAB))
    assert 0 <= edited.box("name").top < 300


def has_warning(edited: Edited) -> bool:
    surface = pygame.Surface(edited.panel.size)
    edited.panel.draw(surface)
    return bool(pygame.mask.from_threshold(surface, WARNING, (1, 1, 1, 255)).count())


def test_invalid_text_stays_with_its_error() -> None:
    edited = Edited()
    below = edited.box("friction").top
    edited.enter("restitution", "2")
    edited.send(key(pygame.K_TAB))
    assert edited.focus == "restitution" and not edited.changes
    assert edited.box("friction").top > below and has_warning(edited)
    edited.click("mass")
    assert edited.focus == "mass" and has_warning(edited)
    edited.click("restitution")
    edited.send(key(pygame.K_HOME))
    edited.type("0.")
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", "restitution", 0.2)]
    assert edited.box("friction").top == below and not has_warning(edited)
    edited.enter("restitution", "2")
    edited.send(key(pygame.K_ESCAPE))
    assert not has_warning(edited)


def test_error_of_the_callback_is_shown_until_the_value_is_accepted() -> None:
    edited = Edited()
    edited.error = "the balls a and b overlap"
    edited.enter("radius", "3")
    assert has_warning(edited) and edited.focus == "radius"
    edited.error = None
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", "radius", 3.0)] * 2
    assert not has_warning(edited) and not edited.panel.has_focus
    edited.error = "must not be fixed"
    edited.click("fixed")
    assert has_warning(edited)
    edited.error = None
    edited.enter("radius", "4")
    assert not has_warning(edited)


def test_error_ends_when_the_value_changes_otherwise() -> None:
    edited = Edited()
    edited.enter("restitution", "2")
    edited.panel.commit()
    edited.panel.show((section(Ball, BALL, "ball"),))
    assert has_warning(edited)
    edited.panel.show((section(Ball, {**BALL, "restitution": 0.5}),))
    assert not has_warning(edited)


def test_click_that_moves_its_target_by_an_error_still_counts() -> None:
    edited = Edited()
    edited.click("restitution")
    edited.type("2")
    edited.click("fixed")
    assert edited.changes == [("ball", "fixed", True)]
    edited.click("restitution")
    edited.click("collides")
    assert edited.changes[1:] == [("ball", "collides", "fixed")]


@pytest.mark.parametrize(
    ("field", "value", "button", "expected"),
    [
        ("fixed", None, 1, True),
        ("fixed", False, 1, True),
        ("fixed", True, 1, False),
        ("fixed", True, 3, False),
        ("fixed", "mixed", 1, True),
        ("fixed", "mixed", 3, False),
        ("collides", None, 1, "fixed"),
        ("collides", "none", 1, "all"),
        ("collides", "all", 3, "none"),
        ("collides", "mixed", 1, "all"),
        ("collides", "mixed", 3, "none"),
        ("response", None, 1, "impulse"),  # an optional choice can be left out
        ("response", "penalty", 1, None),
        ("response", None, 3, "penalty"),
        ("response", "impulse", 3, None),
        ("continuous", None, 1, False),
        ("continuous", True, 1, None),
        ("continuous", None, 3, True),
    ],
)
def test_click_on_a_check_box_or_choice(field: str, value: Any, button: int, expected: Any) -> None:
    model, of = (Ball, "ball") if field in ("fixed", "collides") else (Settings, "settings")
    mixed = value == "mixed"
    edited = Edited(section(model, {} if mixed else {field: value}, mixed=(field,) if mixed else ()))
    edited.click(field, of, button)
    assert edited.changes == [(of, field, expected)]
    assert not edited.panel.has_focus


def test_mixed_values_change_only_if_something_is_typed() -> None:
    edited = Edited(section(Ball, BALL, "3 balls", ("radius", "mass")))
    edited.click("radius")
    edited.send(key(pygame.K_RETURN))
    assert not edited.changes and not edited.panel.has_focus
    edited.enter("radius", "0.05")
    edited.click("mass")
    edited.send(key(pygame.K_BACKSPACE), key(pygame.K_RETURN))
    assert edited.changes == [("ball", "radius", 0.05), ("ball", "mass", None)]


def test_lists_and_tables_within_the_table_are_edited_but_no_long_list() -> None:
    edited = Edited(section(Wall, {"points": [[k, 0] for k in range(1000)]}, "wall"))
    for button in (1, 3):
        edited.click("points", "wall", button)
        assert not edited.panel.has_focus and not edited.changes
    edited = Edited(section(Wall, {"points": [[0, 0], [1, 1]]}, "wall"))
    for field, text in (("points", "0, 0; 2, 0"), ("layers", "a, b"), ("kick.speed", "2")):
        edited.click(field, "wall")
        edited.send(key(pygame.K_a, pygame.KMOD_CTRL))
        edited.type(text)
        edited.send(key(pygame.K_RETURN))
    assert edited.changes == [
        ("wall", "points", [[0.0, 0.0], [2.0, 0.0]]),
        ("wall", "layers", ["a", "b"]),
        ("wall", "kick.speed", 2.0),
    ]


def test_keys_belong_to_the_field_only_while_it_is_edited() -> None:
    edited = Edited()
    assert edited.send(key(pygame.K_SPACE), text_input(" "), key(pygame.K_TAB)) == [False] * 3
    edited.click("name")
    assert edited.send(key(pygame.K_SPACE), key(pygame.K_p), key(pygame.K_a, pygame.KMOD_CTRL)) == [True] * 3
    assert edited.send(key(pygame.K_s, pygame.KMOD_CTRL), key(pygame.K_F11)) == [False] * 2
    assert edited.panel.has_focus


def test_click_in_the_edited_text_places_the_caret_and_a_drag_selects() -> None:
    edited = Edited()
    edited.click("name")
    box = edited.box("name")
    edited.send(press(box.left + 6, box.centery), release(box.left + 6, box.centery))
    edited.type("x")
    edited.send(press(box.right - 8, box.centery))
    edited.send(move(box.left, box.centery, held=True), release(box.left, box.centery))
    edited.send(key(pygame.K_RIGHT))
    edited.type("y")
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", "name", "xcuey")]


def test_show_keeps_focus_and_text_while_the_field_exists() -> None:
    edited = Edited(size=(1280, 1100))
    edited.click("radius")
    edited.type("2")
    edited.panel.show((section(World, {}), section(Ball, {**BALL, "position": [5.0, 5.0], "radius": 0.1})))
    assert edited.focus == "radius"
    edited.type("5")
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", "radius", 25.0)]
    edited.click("radius")
    edited.panel.show((section(World, {}),))
    assert not edited.panel.has_focus


def test_callback_may_show_other_content() -> None:
    edited = Edited()

    def change(of: str, field: str, value: Any) -> None:
        edited.changes.append((of, field, value))
        edited.panel.show((section(World, {}),))

    edited.panel.on_change = change
    edited.click("radius")
    edited.type("2")
    edited.send(key(pygame.K_TAB))
    assert edited.changes == [("ball", "radius", 2.0)] and not edited.panel.has_focus
    edited.picture()


def test_heading_folds_and_the_state_is_kept_by_key() -> None:
    edited = Edited(section(Ball, BALL), section(World, {}, is_open=False))
    assert edited.panel.box_of("world", "wind") is None
    edited.click_heading("ball")
    assert edited.panel.box_of("ball", "radius") is None
    edited.click_heading("world")
    assert edited.panel.box_of("world", "wind") is not None
    edited.panel.show((section(Ball, {**BALL, "radius": 1.0}, "another ball"), section(World, {}, is_open=False)))
    assert not edited.panel.is_open("ball") and edited.panel.is_open("world")
    edited.click_heading("ball", button=3)
    assert not edited.panel.is_open("ball")


def test_wheel_scrolls_and_never_changes_values() -> None:
    edited = Edited(section(Ball, BALL), section(Settings, {}), section(World, {}))
    top = edited.box("radius").top
    assert edited.send(wheel(-1)) == [False]
    assert edited.send(move(*edited.box("radius").center), wheel(-1)) == [True, True]
    assert edited.box("radius").top == top - 48
    edited.send(*[wheel(1)] * 5)
    assert edited.box("radius").top == top
    edited.send(*[wheel(-1)] * 100)
    assert edited.box("wind", "world").bottom <= SIZE[1]
    assert not edited.changes
    assert edited.send(move(100, 100), wheel(1)) == [False, False]


def test_scroll_bar_can_be_dragged() -> None:
    edited = Edited(section(Ball, BALL), section(Settings, {}), section(World, {}))
    x = SIZE[0] - 3
    edited.send(press(x, SIZE[1] - 1), move(x, SIZE[1] - 1, held=True), release(x, SIZE[1] - 1))
    assert edited.box("wind", "world").bottom <= SIZE[1]
    edited.send(press(x, 1), move(900, 0, held=True), release(900, 0))
    assert edited.box("name").top > 0
    before = edited.box("name").top
    edited.send(move(x, 500))
    assert edited.box("name").top == before


@pytest.mark.parametrize(("size", "ui_scale"), [((640, 360), 1.0), ((2560, 1440), 3.0), ((1, 1), 1.5)])
def test_resize_keeps_the_field_and_its_text(size: tuple[int, int], ui_scale: float) -> None:
    edited = Edited(section(Ball, BALL), section(Settings, {}))
    edited.click("radius")
    edited.type("2")
    edited.panel.resize(size, ui_scale)
    edited.picture()
    box = edited.box("radius")
    assert size[0] - edited.panel.width <= box.left < box.right <= max(size[0], box.left + 1)
    edited.send(key(pygame.K_RETURN))
    assert edited.changes == [("ball", "radius", 2.0)]


def test_description_is_shown_at_the_label() -> None:
    edited = Edited()
    box, left_of_panel = edited.box("radius"), pygame.Rect(0, 0, SIZE[0] - edited.panel.width, SIZE[1])

    def is_shown(x: int) -> bool:
        edited.send(move(x, box.centery))
        surface = pygame.Surface(SIZE, pygame.SRCALPHA)
        edited.panel.draw(surface)
        return surface.subsurface(left_of_panel).get_bounding_rect().width > 0

    assert is_shown(box.left - 20)
    assert not is_shown(box.centerx)
    assert not is_shown(10)


def test_picture_depends_on_values_mixture_and_note() -> None:
    edited = Edited()
    pictures = {edited.picture()}
    shown: tuple[tuple[PropertySection, str], ...] = (
        (section(Ball, {**BALL, "radius": 0.06}), ""),
        (section(Ball, BALL, mixed=("radius",)), ""),
        (section(Ball, BALL), "Nothing is selected."),
        (section(Ball, {**BALL, "colour": "#ff8000"}), ""),
        (section(Ball, {**BALL, "fixed": True}), ""),
    )
    for each, note in shown:
        edited.panel.show((each,), note)
        pictures.add(edited.picture())
    assert len(pictures) == len(shown) + 1


KEYS = (
    pygame.K_LEFT, pygame.K_RIGHT, pygame.K_HOME, pygame.K_END, pygame.K_BACKSPACE, pygame.K_DELETE, pygame.K_RETURN,
    pygame.K_TAB, pygame.K_ESCAPE, pygame.K_a, pygame.K_UP,
)  # fmt: skip
EVENTS = st.one_of(
    st.builds(press, st.integers(1000, 1290), st.integers(0, 400), st.sampled_from((1, 2, 3))),
    st.builds(release, st.integers(1000, 1290), st.integers(0, 400), st.sampled_from((1, 2, 3))),
    st.builds(move, st.integers(1000, 1290), st.integers(0, 400), st.booleans()),
    st.builds(wheel, st.integers(-3, 3)),
    st.builds(key, st.sampled_from(KEYS), st.sampled_from((0, pygame.KMOD_SHIFT, pygame.KMOD_CTRL))),
    st.builds(text_input, st.text(max_size=3)),
    st.just(FOCUS_LOST),
)


@pytest.mark.fail_slow(60)  # takes over half a second
@given(st.lists(EVENTS, max_size=30), st.booleans())
def test_any_events_report_only_values_of_fields(events: list[pygame.event.Event], is_rejected: bool) -> None:
    edited = Edited(section(Ball, BALL), section(Settings, {}), size=(1280, 400))
    edited.error = "no" if is_rejected else None
    for event in events:
        edited.send(event)
        edited.picture()
    edited.panel.commit()
    keys = {"ball": [spec.key for spec in fields_of(Ball)], "settings": [spec.key for spec in fields_of(Settings)]}
    assert all(field in keys[of] for of, field, _ in edited.changes)
    assert not edited.panel.has_focus


def test_unchanged_rows_are_not_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    original = property_panel.draw_text
    monkeypatch.setattr(
        property_panel, "draw_text", lambda *args, **more: texts.append(args[1]) or original(*args, **more)
    )
    edited = Edited()
    surface = pygame.Surface(SIZE)
    edited.panel.draw(surface)
    assert "radius" in texts
    texts.clear()
    edited.panel.show((section(Ball, BALL),))  # equal content
    edited.panel.draw(surface)
    assert texts == []
