"""Side panel: callbacks, consumed events, scrolling, and release of replaced widgets."""

import gc
import weakref

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.window.playback.parameters import Parameter
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.ui.panel import BUTTONS, SidePanel
from sandbox.window.ui.widgets import Checkbox, ParameterSlider, PushButton, Widget
from tests.window.pressing import FOCUS_LOST, move, press, release, wheel

SIZE = (1280, 800)
SHOWN = ("play", "step", "back", "restart", "camera", "record", "save")
TOGGLES = dict.fromkeys((*OVERLAYS, "ghost", "trust", "sound", "antialias"), False)
PARAMETERS = (
    Parameter("gravity", "gravity", -30, 30, -9.8, step=0.1, unit="m/s²", default=-9.8),
    Parameter("friction", "friction", 0, 2, 0.5, enabled=False, why="nothing rubs here"),
    Parameter("dt", "time step", 1e-4, 0.1, 0.01, log=True, step=0.1, unit="s"),
    Parameter("integrator", "integrator", value="b", choices=("a", "b")),
)


class RecordedPanel:
    """A panel that records its callbacks."""

    def __init__(self, size: tuple[int, int] = SIZE, unit: float = 1.0) -> None:
        self.calls: list[tuple[object, ...]] = []
        self.panel = SidePanel(size, unit)
        self.panel.on_change = lambda key, value, final: self.calls.append(("change", key, value, final))
        self.panel.on_toggle = lambda name, on: self.calls.append(("toggle", name, on))
        self.panel.on_button = lambda name: self.calls.append(("button", name))
        self.panel.show(PARAMETERS, TOGGLES, SHOWN)

    def find(self, name: str) -> Widget:
        for widget in self.panel.widgets:
            named = widget.name if isinstance(widget, Checkbox | PushButton) else widget.parameter.key  # type: ignore[attr-defined]  # the rest show parameters
            if named == name:
                return widget
        raise AssertionError(name)

    def centre(self, name: str) -> tuple[int, int]:
        x, y = self.find(name).rect.center
        return x + self.panel.size[0] - self.panel.width, y


def test_click_on_any_widget_within_one_frame_makes_one_callback() -> None:
    recorded = RecordedPanel()
    for name in (*SHOWN, *TOGGLES, "integrator"):
        assert recorded.panel.handle_event(press(*recorded.centre(name)))
        assert recorded.panel.handle_event(release(*recorded.centre(name)))
    buttons = [("button", BUTTONS[name].command) for name in SHOWN]
    toggles = [("toggle", name, True) for name in TOGGLES]
    assert recorded.calls == [*buttons, *toggles, ("change", "integrator", "a", True)]


def test_slider_stays_held_while_the_mouse_is_over_the_picture() -> None:
    recorded = RecordedPanel()
    panel = recorded.panel
    x, y = recorded.centre("gravity")
    assert panel.handle_event(press(x, y))
    assert panel.handle_event(move(10, 10, held=True))
    assert panel.handle_event(release(10, 10))
    assert recorded.calls == [
        ("change", "gravity", 0.0, False),
        ("change", "gravity", -30, False),
        ("change", "gravity", -30, True),
    ]
    assert not panel.handle_event(release(10, 10))


def test_drag_that_began_in_the_picture_is_not_consumed() -> None:
    panel = RecordedPanel().panel
    inside = SIZE[0] - 40
    assert not panel.handle_event(press(100, 100))
    assert not panel.handle_event(move(inside, 100, held=True))
    assert not panel.handle_event(release(inside, 100))
    assert panel.handle_event(move(inside, 100))


def test_show_makes_no_callbacks_and_keeps_the_widgets() -> None:
    recorded = RecordedPanel()
    before = recorded.panel.widgets
    recorded.panel.show(
        [*PARAMETERS[:2], Parameter("dt", "time step", 1e-3, 1, 0.5, log=True), PARAMETERS[3]], TOGGLES, SHOWN
    )
    recorded.panel.show(PARAMETERS, {**TOGGLES, "trails": True}, ("pause", *SHOWN[1:]))
    assert recorded.calls == []
    assert recorded.panel.widgets == before
    trails = recorded.find("trails")
    assert isinstance(trails, Checkbox)
    assert trails.on


def test_drag_continues_when_other_content_is_shown() -> None:
    recorded = RecordedPanel()
    x, y = recorded.centre("gravity")
    recorded.panel.handle_event(press(x, y))
    recorded.panel.show(PARAMETERS, TOGGLES, ("pause", *SHOWN[1:]))
    recorded.panel.show(PARAMETERS[:3], {"trails": True}, ())  # another layout
    assert recorded.panel.handle_event(move(5000, y, held=True))
    recorded.panel.handle_event(release(5000, y))
    assert recorded.calls[-1] == ("change", "gravity", 30, True)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_replaced_widgets_are_released() -> None:
    recorded = RecordedPanel()
    known = [weakref.ref(widget) for widget in recorded.panel.widgets]
    recorded.panel.show((Parameter("gravity", "gravity", choices=("a", "b"), value="a"),), {}, ())
    gc.collect()
    assert len(recorded.panel.widgets) == 1
    assert not any(ref() for ref in known)


def test_lost_focus_and_hiding_end_a_drag_with_a_final_callback() -> None:
    for end in (lambda panel: panel.handle_event(FOCUS_LOST), lambda panel: setattr(panel, "visible", False)):
        recorded = RecordedPanel()
        recorded.panel.handle_event(press(*recorded.centre("gravity")))
        end(recorded.panel)
        assert recorded.calls == [("change", "gravity", 0.0, False), ("change", "gravity", 0.0, True)]
        recorded.panel.visible = True
        recorded.panel.handle_event(move(10, 10))
        assert len(recorded.calls) == 2


def test_hidden_panel_draws_nothing_and_consumes_no_events() -> None:
    panel = RecordedPanel().panel
    assert panel.width == 264
    panel.visible = False
    assert panel.width == 0
    assert not panel.handle_event(press(SIZE[0] - 40, 100))
    surface = pygame.Surface(SIZE)
    panel.draw(surface)
    assert not pygame.surfarray.array3d(surface).any()


def test_wheel_changes_the_slider_below_it_and_scrolls_elsewhere() -> None:
    recorded = RecordedPanel((640, 300))
    panel = recorded.panel
    panel.handle_event(move(*recorded.centre("gravity")))
    assert panel.handle_event(wheel(1))
    assert recorded.calls == [("change", "gravity", -9.7, True)]
    top = recorded.find("gravity").rect.top
    panel.handle_event(move(640 - panel.width + 3, 150))
    assert panel.handle_event(wheel(-1))
    assert recorded.find("gravity").rect.top < top
    for _ in range(50):
        panel.handle_event(wheel(-1))
    assert recorded.find("antialias").rect.bottom <= 300
    for _ in range(50):
        panel.handle_event(wheel(1))
    assert recorded.find("gravity").rect.top == top
    panel.handle_event(move(10, 10))
    assert not panel.handle_event(wheel(-1))


def test_scroll_bar_at_the_edge_scrolls() -> None:
    recorded = RecordedPanel((640, 300))
    assert recorded.panel.handle_event(press(637, 299))
    assert recorded.find("antialias").rect.bottom <= 300
    assert recorded.panel.handle_event(move(637, -50, held=True))
    assert recorded.panel.handle_event(release(637, -50))
    assert recorded.find("play").rect.top > 0
    assert recorded.calls == []


def test_reason_of_a_disabled_parameter_is_shown() -> None:
    recorded = RecordedPanel()
    plain, hovered = pygame.Surface(SIZE), pygame.Surface(SIZE)
    recorded.panel.draw(plain)
    recorded.panel.handle_event(move(*recorded.centre("friction")))
    recorded.panel.draw(hovered)
    left = SIZE[0] - recorded.panel.width
    assert recorded.find("friction").hint == "nothing rubs here"
    assert pygame.image.tobytes(plain, "RGB") != pygame.image.tobytes(hovered, "RGB")
    assert not pygame.surfarray.array3d(plain)[:left].any()


@pytest.mark.parametrize("change", ["hover", "knob", "toggle", "button", "scroll", "label"])
def test_cached_picture_is_redrawn_after_a_change(change: str) -> None:
    recorded = RecordedPanel((640, 420))  # lower than its content; the checkboxes are partly visible
    panel = recorded.panel
    before, same, after = (pygame.Surface((640, 420)) for _ in range(3))
    panel.draw(before)
    panel.draw(same)
    assert pygame.image.tobytes(before, "RGB") == pygame.image.tobytes(same, "RGB")
    if change == "hover":
        panel.handle_event(move(*recorded.centre("gravity")))
    elif change == "scroll":
        panel.handle_event(press(637, 419))
    else:
        name = "height" if change == "label" else "gravity"
        parameter = Parameter("gravity", name, -30, 30, 5.0 if change == "knob" else -9.8, step=0.1, unit="m/s²")
        buttons = ("pause" if change == "button" else "play", *SHOWN[1:])
        panel.show((parameter, *PARAMETERS[1:]), {**TOGGLES, "shapes": change == "toggle"}, buttons)
    panel.draw(after)
    assert pygame.image.tobytes(before, "RGB") != pygame.image.tobytes(after, "RGB")


def test_callback_may_replace_the_content() -> None:
    recorded = RecordedPanel()
    recorded.panel.on_button = lambda name: recorded.panel.show((), {}, ())
    recorded.panel.handle_event(press(*recorded.centre("play")))
    recorded.panel.handle_event(release(*recorded.centre("play")))
    assert recorded.panel.widgets == ()


def test_buttons_name_their_keys() -> None:
    recorded = RecordedPanel()
    assert recorded.find("play").hint == "Resume (P or Space)"
    assert recorded.find("camera").hint == "Screenshot (Ctrl+P)"


@pytest.mark.parametrize(("size", "unit"), [((640, 480), 1.0), ((1280, 800), 1.0), ((3840, 2160), 2.0)])
def test_widgets_do_not_overlap_and_stay_inside(size: tuple[int, int], unit: float) -> None:
    panel = RecordedPanel(size, unit).panel
    rects = [widget.row if isinstance(widget, ParameterSlider) else widget.rect for widget in panel.widgets]
    assert all(rect.collidelist(rects[k + 1 :]) < 0 for k, rect in enumerate(rects))
    assert all(rect.left >= 0 and rect.right <= panel.width for rect in rects)


@given(st.integers(1, 500), st.integers(1, 400), st.floats(0.25, 4), st.integers(0, 4))
def test_panel_is_drawn_on_any_size(width: int, height: int, unit: float, count: int) -> None:
    panel = SidePanel((width, height), unit)
    panel.visible = True  # a small window hides it
    panel.show(PARAMETERS[:count], TOGGLES, SHOWN)
    surface = pygame.Surface((width, height))
    panel.handle_event(move(width - 1, height // 2))
    panel.draw(surface)
    panel.resize((height, width), unit / 2)
    panel.draw(pygame.Surface((height, width)))
    assert 0 < panel.width <= height
