"""Panel: callbacks, what it consumes, scrolling, and that showing other things leaves nothing behind."""

import gc
import weakref

import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.window.playback.parameters import Parameter
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.ui.panel import SidePanel
from sandbox.window.ui.widgets import Checkbox, ParameterSlider, PushButton, Widget
from tests.window.pressing import FOCUS_LOST, move, press, release, wheel

SIZE = (1280, 800)
BUTTONS = ("play", "step", "back", "restart", "camera", "record", "save")
TOGGLES = dict.fromkeys((*OVERLAYS, "ghost", "trust", "sound", "antialias"), False)
KNOBS = (
    Parameter("gravity", "gravity", -30, 30, -9.8, step=0.1, unit="m/s²", default=-9.8),
    Parameter("friction", "friction", 0, 2, 0.5, enabled=False, why="nothing rubs here"),
    Parameter("dt", "time step", 1e-4, 0.1, 0.01, log=True, step=0.1, unit="s"),
    Parameter("integrator", "integrator", value="b", choices=("a", "b")),
)


class Noted:
    """A panel, and what it called back."""

    def __init__(self, size: tuple[int, int] = SIZE, unit: float = 1.0) -> None:
        self.calls: list[tuple[object, ...]] = []
        self.panel = SidePanel(size, unit)
        self.panel.on_change = lambda key, value, final: self.calls.append(("change", key, value, final))
        self.panel.on_toggle = lambda name, on: self.calls.append(("toggle", name, on))
        self.panel.on_button = lambda name: self.calls.append(("button", name))
        self.panel.show(KNOBS, TOGGLES, BUTTONS)

    def find(self, name: str) -> Widget:
        for widget in self.panel.widgets:
            named = widget.name if isinstance(widget, Checkbox | PushButton) else widget.parameter.key  # type: ignore[attr-defined]  # the rest are dials
            if named == name:
                return widget
        raise AssertionError(name)

    def middle(self, name: str) -> tuple[int, int]:
        x, y = self.find(name).rect.center
        return x + self.panel.size[0] - self.panel.width, y


def test_click_within_one_frame_calls_back_once() -> None:
    noted = Noted()
    for name in ("play", "trails", "integrator"):
        assert noted.panel.handle_event(press(*noted.middle(name)))
        assert noted.panel.handle_event(release(*noted.middle(name)))
    assert noted.calls == [("button", "play"), ("toggle", "trails", True), ("change", "integrator", "a", True)]


@pytest.mark.parametrize("name", [*BUTTONS, *TOGGLES])
def test_every_button_and_switch_can_be_reached(name: str) -> None:
    noted = Noted()
    noted.panel.handle_event(press(*noted.middle(name)))
    noted.panel.handle_event(release(*noted.middle(name)))
    assert [call[1] for call in noted.calls] == [name]


def test_slider_holds_while_the_mouse_is_over_the_picture() -> None:
    noted = Noted()
    panel = noted.panel
    x, y = noted.middle("gravity")
    assert panel.handle_event(press(x, y))
    assert panel.handle_event(move(10, 10, held=True))
    assert panel.handle_event(release(10, 10))
    assert noted.calls == [
        ("change", "gravity", 0.0, False),
        ("change", "gravity", -30, False),
        ("change", "gravity", -30, True),
    ]
    assert not panel.handle_event(release(10, 10))


def test_drag_that_began_in_the_picture_is_not_consumed() -> None:
    panel = Noted().panel
    inside = SIZE[0] - 40
    assert not panel.handle_event(press(100, 100))
    assert not panel.handle_event(move(inside, 100, held=True))
    assert not panel.handle_event(release(inside, 100))
    assert panel.handle_event(move(inside, 100))


def test_showing_values_calls_nobody_back_and_keeps_the_widgets() -> None:
    noted = Noted()
    before = noted.panel.widgets
    noted.panel.show([*KNOBS[:2], Parameter("dt", "time step", 1e-3, 1, 0.5, log=True), KNOBS[3]], TOGGLES, BUTTONS)
    noted.panel.show(KNOBS, {**TOGGLES, "trails": True}, ("pause", *BUTTONS[1:]))
    assert noted.calls == []
    assert noted.panel.widgets == before
    trails = noted.find("trails")
    assert isinstance(trails, Checkbox)
    assert trails.on


def test_drag_survives_what_is_shown_meanwhile() -> None:
    noted = Noted()
    x, y = noted.middle("gravity")
    noted.panel.handle_event(press(x, y))
    noted.panel.show(KNOBS, TOGGLES, ("pause", *BUTTONS[1:]))
    noted.panel.show(KNOBS[:3], {"trails": True}, ())  # another layout
    assert noted.panel.handle_event(move(5000, y, held=True))
    noted.panel.handle_event(release(5000, y))
    assert noted.calls[-1] == ("change", "gravity", 30, True)


def test_panels_leave_nothing_behind() -> None:
    noted = Noted()
    known = [weakref.ref(widget) for widget in noted.panel.widgets]
    noted.panel.show((Parameter("gravity", "gravity", choices=("a", "b"), value="a"),), {}, ())
    gc.collect()
    assert len(noted.panel.widgets) == 1
    assert not any(ref() for ref in known)


def test_lost_focus_and_hiding_end_a_drag_with_a_final_call() -> None:
    for end in (lambda panel: panel.handle_event(FOCUS_LOST), lambda panel: setattr(panel, "visible", False)):
        noted = Noted()
        noted.panel.handle_event(press(*noted.middle("gravity")))
        end(noted.panel)
        assert noted.calls == [("change", "gravity", 0.0, False), ("change", "gravity", 0.0, True)]
        noted.panel.visible = True
        noted.panel.handle_event(move(10, 10))
        assert len(noted.calls) == 2


def test_hidden_panel_covers_and_takes_nothing() -> None:
    panel = Noted().panel
    assert panel.width == 264
    panel.visible = False
    assert panel.width == 0
    assert not panel.handle_event(press(SIZE[0] - 40, 100))
    surface = pygame.Surface(SIZE)
    panel.draw(surface)
    assert not pygame.surfarray.array3d(surface).any()


def test_wheel_turns_the_slider_below_it_and_scrolls_elsewhere() -> None:
    noted = Noted((640, 300))
    panel = noted.panel
    panel.handle_event(move(*noted.middle("gravity")))
    assert panel.handle_event(wheel(1))
    assert noted.calls == [("change", "gravity", -9.7, True)]
    top = noted.find("gravity").rect.top
    panel.handle_event(move(640 - panel.width + 3, 150))
    assert panel.handle_event(wheel(-1))
    assert noted.find("gravity").rect.top < top
    for _ in range(50):
        panel.handle_event(wheel(-1))
    assert noted.find("antialias").rect.bottom <= 300
    for _ in range(50):
        panel.handle_event(wheel(1))
    assert noted.find("gravity").rect.top == top
    panel.handle_event(move(10, 10))
    assert not panel.handle_event(wheel(-1))


def test_bar_at_the_edge_scrolls() -> None:
    noted = Noted((640, 300))
    assert noted.panel.handle_event(press(637, 299))
    assert noted.find("antialias").rect.bottom <= 300
    assert noted.panel.handle_event(move(637, -50, held=True))
    assert noted.panel.handle_event(release(637, -50))
    assert noted.find("play").rect.top > 0
    assert noted.calls == []


def test_reason_is_shown_beside_a_disabled_knob() -> None:
    noted = Noted()
    plain, hovered = pygame.Surface(SIZE), pygame.Surface(SIZE)
    noted.panel.draw(plain)
    noted.panel.handle_event(move(*noted.middle("friction")))
    noted.panel.draw(hovered)
    left = SIZE[0] - noted.panel.width
    assert noted.find("friction").hint == "nothing rubs here"
    assert pygame.image.tobytes(plain, "RGB") != pygame.image.tobytes(hovered, "RGB")
    assert not pygame.surfarray.array3d(plain)[:left].any()


@pytest.mark.parametrize("change", ["hover", "knob", "toggle", "button", "scroll", "label"])
def test_kept_picture_is_drawn_anew_when_something_changes(change: str) -> None:
    noted = Noted((640, 420))  # lower than its content; the switches are partly in sight
    panel = noted.panel
    before, same, after = (pygame.Surface((640, 420)) for _ in range(3))
    panel.draw(before)
    panel.draw(same)
    assert pygame.image.tobytes(before, "RGB") == pygame.image.tobytes(same, "RGB")
    if change == "hover":
        panel.handle_event(move(*noted.middle("gravity")))
    elif change == "scroll":
        panel.handle_event(press(637, 419))
    else:
        name = "height" if change == "label" else "gravity"
        knob = Parameter("gravity", name, -30, 30, 5.0 if change == "knob" else -9.8, step=0.1, unit="m/s²")
        buttons = ("pause" if change == "button" else "play", *BUTTONS[1:])
        panel.show((knob, *KNOBS[1:]), {**TOGGLES, "shapes": change == "toggle"}, buttons)
    panel.draw(after)
    assert pygame.image.tobytes(before, "RGB") != pygame.image.tobytes(after, "RGB")


def test_callback_may_show_something_else() -> None:
    noted = Noted()
    noted.panel.on_button = lambda name: noted.panel.show((), {}, ())
    noted.panel.handle_event(press(*noted.middle("play")))
    noted.panel.handle_event(release(*noted.middle("play")))
    assert noted.panel.widgets == ()


def test_buttons_name_their_keys() -> None:
    noted = Noted()
    assert noted.find("play").hint == "Resume (P or Space)"
    assert noted.find("camera").hint == "Screenshot (Ctrl+P)"


@pytest.mark.parametrize(("size", "unit"), [((640, 480), 1.0), ((1280, 800), 1.0), ((3840, 2160), 2.0)])
def test_widgets_keep_apart_and_inside(size: tuple[int, int], unit: float) -> None:
    panel = Noted(size, unit).panel
    rects = [widget.row if isinstance(widget, ParameterSlider) else widget.rect for widget in panel.widgets]
    assert all(rect.collidelist(rects[k + 1 :]) < 0 for k, rect in enumerate(rects))
    assert all(rect.left >= 0 and rect.right <= panel.width for rect in rects)


@given(st.integers(1, 500), st.integers(1, 400), st.floats(0.25, 4), st.integers(0, 4))
@settings(max_examples=40, deadline=None)
def test_panel_is_drawn_on_any_size(width: int, height: int, unit: float, count: int) -> None:
    panel = SidePanel((width, height), unit)
    panel.visible = True  # a small window folds it away
    panel.show(KNOBS[:count], TOGGLES, BUTTONS)
    surface = pygame.Surface((width, height))
    panel.handle_event(move(width - 1, height // 2))
    panel.draw(surface)
    panel.resize((height, width), unit / 2)
    panel.draw(pygame.Surface((height, width)))
    assert 0 < panel.width <= height
