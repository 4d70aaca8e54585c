"""Widgets: clicks and drags by events, within one frame or over several."""

import gc
import weakref

import pygame
import pytest

from sandbox.window.playback.parameters import Parameter
from sandbox.window.ui.icons import ICON_NAMES, icon
from sandbox.window.ui.widgets import (
    DOUBLE_CLICK_MS,
    Checkbox,
    OptionButton,
    ParameterSlider,
    PushButton,
    Widget,
    WidgetEvent,
)
from tests.window.pressing import move, press, release

ROW = pygame.Rect(20, 20, 214, 34)  # a slider's track is then 200 px long
KNOB = Parameter("friction", "friction", 0.0, 2.0, 0.5, step=0.01, default=0.3)


def slider(knob: Parameter = KNOB) -> ParameterSlider:
    made = ParameterSlider(pygame.Surface((300, 100)), knob)
    made.set_rect(ROW, 1.0)
    made.show_parameter(knob)
    return made


def placed(widget: Widget) -> Widget:
    widget.set_rect(ROW, 1.0)
    return widget


def at(made: ParameterSlider, share: float) -> tuple[float, float]:
    track = made.rect
    return track.left + share * track.width, track.centery


def changes(widget: Widget) -> list[tuple[object, bool]]:
    return [(report.value, report.final) for report in widget.events]


def send(widget: Widget, *events: pygame.event.Event) -> None:
    for event in events:
        widget.handle_event(event)


def test_press_and_release_in_one_frame_change_the_value() -> None:
    made = slider()
    send(made, press(*at(made, 0.75)), release(*at(made, 0.75)))
    assert changes(made) == [(1.5, False), (1.5, True)]
    assert not made.held


def test_press_on_the_handle_without_moving_changes_nothing() -> None:
    made = slider()
    x, y = at(made, 0.25)
    send(made, press(x + 3, y), release(x + 3, y))
    assert changes(made) == []


def test_drag_goes_on_outside_and_ends_exactly_at_the_ends() -> None:
    made = slider()
    send(made, press(*at(made, 0.5)), move(5000, 900, held=True))
    send(made, move(-5000, -900, held=True))
    send(made, release(5000, 900))
    assert changes(made) == [(1.0, False), (2.0, False), (0.0, False), (2.0, False), (2.0, True)]


def test_grip_beside_the_middle_of_the_handle_does_not_jump() -> None:
    made = slider()
    x, y = at(made, 0.25)
    send(made, press(x + 4, y), move(x + 5, y, held=True), release(x + 5, y))
    assert changes(made) == [(0.51, False), (0.51, True)]


def test_drag_back_to_the_start_ends_with_a_final_report_too() -> None:
    made = slider()
    x, y = at(made, 0.25)
    send(made, press(x, y), move(x + 40, y, held=True), move(x, y, held=True), release(x, y))
    assert changes(made) == [(0.9, False), (0.5, False), (0.5, True)]


def test_logarithmic_slider_hits_its_ends() -> None:
    made = slider(Parameter("dt", "dt", 1e-4, 0.1, 0.01, log=True, step=0.1, unit="s"))
    send(made, press(*at(made, 0.5)), move(-900, 0, held=True), move(900, 0, held=True), release(900, 0))
    assert [value for value, _ in changes(made)][1:] == [1e-4, 0.1, 0.1]


def test_double_click_goes_back_to_the_default() -> None:
    made = slider()
    send(made, press(*at(made, 0.9)), release(*at(made, 0.9)))
    made.events.clear()
    send(made, press(*at(made, 0.9)), release(*at(made, 0.9)))
    assert changes(made) == [(0.3, True)]
    assert made.fraction == 0.15


def test_slow_second_click_is_no_double_click(monkeypatch: pytest.MonkeyPatch) -> None:
    made = slider()
    monkeypatch.setattr(pygame.time, "get_ticks", lambda: 1000)
    send(made, press(*at(made, 0.9)), release(*at(made, 0.9)))
    monkeypatch.setattr(pygame.time, "get_ticks", lambda: 1001 + DOUBLE_CLICK_MS)
    send(made, press(*at(made, 0.9)), release(*at(made, 0.9)))
    assert made.value == 1.8


def test_disabled_slider_keeps_its_value_and_says_why() -> None:
    made = slider(Parameter("friction", "friction", 0, 2, 0.5, enabled=False, why="nothing rubs"))
    send(made, press(*at(made, 0.9)), release(*at(made, 0.9)))
    assert not made.scroll(1, (round(at(made, 0.5)[0]), made.rect.centery))
    assert changes(made) == []
    assert made.hint == "nothing rubs"


def test_showing_a_value_reports_nothing_and_leaves_a_drag_alone() -> None:
    made = slider()
    made.show_parameter(Parameter("friction", "friction", 0, 2, 1.0))
    assert (made.value, changes(made), made.fraction) == (1.0, [], 0.5)
    send(made, press(*at(made, 0.75)))
    made.show_parameter(Parameter("friction", "friction", 0, 2, 0.1))
    assert made.value == 1.5


def test_wheel_over_the_track_changes_by_one_step() -> None:
    made = slider()
    x, y = (round(part) for part in at(made, 0.5))
    assert made.scroll(1, (x, y))
    assert not made.scroll(1, (x, ROW.top + 2))  # over the label
    assert changes(made) == [(0.51, True)]


def test_choice_goes_on_and_back() -> None:
    made = OptionButton(pygame.Surface((300, 100)), Parameter("i", "integrator", value="b", choices=("a", "b", "c")))
    placed(made)
    right, left = (ROW.right - 5, ROW.centery), (ROW.right - round(0.66 * ROW.width), ROW.centery)
    send(made, press(*right), release(*right))
    send(made, press(*left), release(*left))
    send(made, press(*right, button=3), release(*right, button=3))
    send(made, press(ROW.left + 2, ROW.centery), release(ROW.left + 2, ROW.centery))
    assert changes(made) == [("c", True), ("b", True), ("a", True)]


def test_switch_turns_by_a_click_in_one_frame() -> None:
    made = Checkbox(pygame.Surface((300, 100)), "trails", False)
    placed(made)
    send(made, press(*ROW.center), release(*ROW.center), press(*ROW.center), release(*ROW.center))
    assert made.events == [WidgetEvent("toggle", "trails", True), WidgetEvent("toggle", "trails", False)]


def test_click_that_ends_elsewhere_counts_nowhere() -> None:
    for widget in (
        PushButton(pygame.Surface((300, 100)), "play"),
        Checkbox(pygame.Surface((300, 100)), "trails", False),
    ):
        placed(widget)
        send(widget, press(*ROW.center), release(ROW.right + 9, ROW.bottom + 9))
        send(widget, press(ROW.right + 9, ROW.bottom + 9), release(*ROW.center))
        send(widget, press(*ROW.center, button=3), release(*ROW.center, button=3))
        assert widget.events == []


def test_button_reports_its_name() -> None:
    made = PushButton(pygame.Surface((300, 100)), "play", "Go on")
    placed(made)
    send(made, press(*ROW.center), release(*ROW.center))
    assert made.events == [WidgetEvent("button", "play")]


def test_widgets_go_away_with_the_last_that_holds_them() -> None:
    surface = pygame.Surface((9, 9))
    made = [slider(), OptionButton(surface, KNOB), Checkbox(surface, "a", True), PushButton(surface, "b")]
    known = [weakref.ref(widget) for widget in made]
    del made
    gc.collect()
    assert [ref() for ref in known] == [None] * 4


@pytest.mark.parametrize("name", ICON_NAMES)
def test_every_icon_has_a_shape_of_its_own(name: str) -> None:
    made = icon(name, 24, (255, 255, 255))
    assert made is not None
    lit = pygame.surfarray.array_alpha(made)
    assert 0.08 < (lit > 127).mean() < 0.8
    others = [icon(other, 24, (255, 255, 255)) for other in ICON_NAMES if other != name]
    assert all(other is not None and (pygame.surfarray.array_alpha(other) != lit).any() for other in others)


def test_unknown_icon_is_none() -> None:
    assert icon("teapot", 24, (255, 255, 255)) is None


@pytest.mark.parametrize("size", [(1, 1), (3, 40), (40, 3), (200, 34), (900, 90)])
@pytest.mark.parametrize("unit", [0.3, 1.0, 3.0])
def test_widgets_draw_at_any_size(size: tuple[int, int], unit: float) -> None:
    surface = pygame.Surface((1000, 100))
    words = Parameter("i", "integrator", value="b", choices=("a", "b"), enabled=False)
    for widget in (
        ParameterSlider(surface, KNOB),
        OptionButton(surface, words),
        Checkbox(surface, "trails", True, key="9"),
        PushButton(surface, "play"),
        PushButton(surface, "some name"),
    ):
        widget.set_rect(pygame.Rect((0, 0), size), unit)
        widget.draw()
    assert pygame.surfarray.array3d(surface).any()
