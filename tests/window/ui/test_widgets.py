"""Widgets: clicks and drags by events, within one or several frames."""

import pygame
import pytest

from sandbox.window.playback.parameters import Parameter
from sandbox.window.ui.icons import ICONS, icon
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

ROW = pygame.Rect(20, 20, 214, 34)  # gives a track of 200 px
PARAMETER = Parameter("friction", "friction", 0.0, 2.0, 0.5, step=0.01, default=0.3)


def slider(parameter: Parameter = PARAMETER) -> ParameterSlider:
    widget = ParameterSlider(pygame.Surface((300, 100)), parameter)
    widget.set_rect(ROW, 1.0)
    widget.show_parameter(parameter)
    return widget


def with_rect(widget: Widget) -> Widget:
    widget.set_rect(ROW, 1.0)
    return widget


def track_point(widget: ParameterSlider, fraction: float) -> tuple[float, float]:
    track = widget.rect
    return track.left + fraction * track.width, track.centery


def changes(widget: Widget) -> list[tuple[object, bool]]:
    return [(report.value, report.final) for report in widget.events]


def send(widget: Widget, *events: pygame.event.Event) -> None:
    for event in events:
        widget.handle_event(event)


def test_press_and_release_in_one_frame_change_the_value() -> None:
    widget = slider()
    send(widget, press(*track_point(widget, 0.75)), release(*track_point(widget, 0.75)))
    assert changes(widget) == [(1.5, False), (1.5, True)]
    assert not widget.held


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ([3], []),
        ([4, 5], [(0.51, False), (0.51, True)]),  # no jump to the press
        ([0, 40, 0], [(0.9, False), (0.5, False), (0.5, True)]),
    ],
)
def test_handle_moves_as_far_as_the_mouse(path: list[int], expected: list[tuple[float, bool]]) -> None:
    widget = slider()
    x, y = track_point(widget, 0.25)
    send(widget, press(x + path[0], y), *(move(x + each, y, held=True) for each in path[1:]))
    send(widget, release(x + path[-1], y))
    assert changes(widget) == expected


def test_drag_continues_outside_and_is_exact_at_the_ends() -> None:
    widget = slider()
    send(widget, press(*track_point(widget, 0.5)), move(5000, 900, held=True))
    send(widget, move(-5000, -900, held=True))
    send(widget, release(5000, 900))
    assert changes(widget) == [(1.0, False), (2.0, False), (0.0, False), (2.0, False), (2.0, True)]


@pytest.mark.parametrize(("delay", "expected", "fraction"), [(0, [(0.3, True)], 0.15), (DOUBLE_CLICK_MS + 1, [], 0.9)])
def test_second_click_restores_the_default_if_it_comes_soon(
    delay: int, expected: list[tuple[float, bool]], fraction: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    widget = slider()
    for time in (1000, 1000 + delay):
        monkeypatch.setattr(pygame.time, "get_ticks", lambda now=time: now)
        widget.events.clear()
        send(widget, press(*track_point(widget, 0.9)), release(*track_point(widget, 0.9)))
    assert changes(widget) == expected
    assert widget.fraction == fraction


def test_disabled_slider_keeps_its_value_and_shows_the_reason() -> None:
    widget = slider(Parameter("friction", "friction", 0, 2, 0.5, enabled=False, why="nothing rubs"))
    send(widget, press(*track_point(widget, 0.9)), release(*track_point(widget, 0.9)))
    assert not widget.scroll(1, (round(track_point(widget, 0.5)[0]), widget.rect.centery))
    assert changes(widget) == []
    assert widget.hint == "nothing rubs"


def test_show_parameter_makes_no_events_and_does_not_disturb_a_drag() -> None:
    widget = slider()
    widget.show_parameter(Parameter("friction", "friction", 0, 2, 1.0))
    assert (widget.value, changes(widget), widget.fraction) == (1.0, [], 0.5)
    send(widget, press(*track_point(widget, 0.75)))
    widget.show_parameter(Parameter("friction", "friction", 0, 2, 0.1))
    assert widget.value == 1.5


def test_wheel_over_the_track_changes_by_one_step() -> None:
    widget = slider()
    x, y = (round(part) for part in track_point(widget, 0.5))
    assert widget.scroll(1, (x, y))
    assert not widget.scroll(1, (x, ROW.top + 2))  # over the label
    assert changes(widget) == [(0.51, True)]


def test_option_button_cycles_forwards_and_back() -> None:
    widget = OptionButton(pygame.Surface((300, 100)), Parameter("i", "integrator", value="b", choices=("a", "b", "c")))
    with_rect(widget)
    right, left = (ROW.right - 5, ROW.centery), (ROW.right - round(0.66 * ROW.width), ROW.centery)
    send(widget, press(*right), release(*right))
    send(widget, press(*left), release(*left))
    send(widget, press(*right, button=3), release(*right, button=3))
    send(widget, press(ROW.left + 2, ROW.centery), release(ROW.left + 2, ROW.centery))
    assert changes(widget) == [("c", True), ("b", True), ("a", True)]


def test_checkbox_toggles_by_clicks_within_one_frame() -> None:
    widget = Checkbox(pygame.Surface((300, 100)), "trails", False)
    with_rect(widget)
    send(widget, press(*ROW.center), release(*ROW.center), press(*ROW.center), release(*ROW.center))
    assert widget.events == [WidgetEvent("toggle", "trails", True), WidgetEvent("toggle", "trails", False)]


def test_click_that_starts_or_ends_outside_is_ignored() -> None:
    for widget in (
        PushButton(pygame.Surface((300, 100)), "play"),
        Checkbox(pygame.Surface((300, 100)), "trails", False),
    ):
        with_rect(widget)
        send(widget, press(*ROW.center), release(ROW.right + 9, ROW.bottom + 9))
        send(widget, press(ROW.right + 9, ROW.bottom + 9), release(*ROW.center))
        send(widget, press(*ROW.center, button=3), release(*ROW.center, button=3))
        assert widget.events == []


@pytest.mark.parametrize("name", ICONS)
def test_every_icon_has_a_distinct_shape(name: str) -> None:
    lit = pygame.surfarray.array_alpha(icon(name, 24, (255, 255, 255)))
    assert 0.08 < (lit > 127).mean() < 0.8
    others = [icon(other, 24, (255, 255, 255)) for other in ICONS if other != name]
    assert all((pygame.surfarray.array_alpha(other) != lit).any() for other in others)


def test_unknown_icon_raises_key_error() -> None:
    with pytest.raises(KeyError, match="teapot"):
        icon("teapot", 24, (255, 255, 255))


@pytest.mark.parametrize("size", [(1, 1), (3, 40), (40, 3), (200, 34), (900, 90)])
@pytest.mark.parametrize("unit", [0.3, 1.0, 3.0])
def test_widgets_draw_at_any_size(size: tuple[int, int], unit: float) -> None:
    surface = pygame.Surface((1000, 100))
    words = Parameter("i", "integrator", value="b", choices=("a", "b"), enabled=False)
    for widget in (
        ParameterSlider(surface, PARAMETER),
        OptionButton(surface, words),
        Checkbox(surface, "trails", True, key="9"),
        PushButton(surface, "play"),
    ):
        widget.set_rect(pygame.Rect((0, 0), size), unit)
        widget.draw()
    assert pygame.surfarray.array3d(surface).any()
