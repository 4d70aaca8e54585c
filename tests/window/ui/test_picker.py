"""Scene picker: selection by keys and mouse, filter, faulty files, and one thumbnail per frame."""

from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.scene.files.load import loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.render.palette import BACKGROUND
from sandbox.window.render.renderer import Renderer
from sandbox.window.ui.scene_browser import SceneBrowser, draw_thumbnail, read_scene
from tests.samples import each_shipped_scene
from tests.window.pressing import key, move, press, release, wheel

BALL = 'title = "{title}"\nabout = "{about}"\n[world]\ngravity = [0, -9.81]\n[[ball]]\nposition = [0, 0]\nradius = 1\n'


@pytest.fixture
def files(tmp_path: Path) -> list[tuple[str, Path]]:
    found = []
    for k in range(12):
        path = tmp_path / f"s{k}.toml"
        path.write_text(BALL.format(title=f"Scene {k}", about="even" if k % 2 == 0 else "odd"))
        found.append((f"mine/s{k}", path))
    (tmp_path / "bad.toml").write_text("[[ball]]\nposition = [0, 0]\nradius = -1\n")
    return [*found, ("mine/bad", tmp_path / "bad.toml")]


def draw_picker(files: list[tuple[str, Path]], size: tuple[int, int] = (900, 700), times: int = 40) -> SceneBrowser:
    picker = SceneBrowser(files)
    for _ in range(times):
        picker.draw(pygame.Surface(size), 1.0)
    return picker


def type_text(picker: SceneBrowser, text: str) -> None:
    for letter in text:
        picker.handle_event(key(ord(letter), unicode=letter))


def card_centre(picker: SceneBrowser, index: int) -> tuple[int, int]:
    return picker._rects[index][1].center


def test_one_file_is_read_or_drawn_per_frame(files: list[tuple[str, Path]]) -> None:
    picker = SceneBrowser(files)
    done = 0
    for _ in range(10):
        picker.draw(pygame.Surface((900, 700)), 1.0)
        now = sum((card.thumbnail is not None) + (card.image is not None) for card in picker.cards)
        assert now == done + 1
        done = now


def test_all_files_are_read_and_only_visible_ones_drawn(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files)
    assert all(card.thumbnail is not None for card in picker.cards)
    assert picker.cards[0].image is not None
    assert picker.cards[-1].image is None
    assert (picker.cards[3].title, picker.cards[3].folder, picker.cards[3].about) == ("Scene 3", "mine", "odd")


def test_faulty_file_shows_its_first_fault(files: list[tuple[str, Path]], tmp_path: Path) -> None:
    crowd = tmp_path / "crowd.toml"
    crowd.write_text("[[scatter]]\ncount = 50\nlower = [0, 0]\nupper = [1, 1]\nradius = 0.5\n")
    for path, fault in ((files[-1][1], "line 3: ball[0].radius"), (tmp_path / "none.toml", "no file"), (crowd, "")):
        found = read_scene(path)
        assert found.scene is None
        assert found.fault
        assert fault in found.fault


def test_arrows_and_enter_select_a_scene(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files)
    columns = picker._columns
    assert columns > 1
    picker.handle_event(key(pygame.K_RIGHT))
    picker.handle_event(key(pygame.K_DOWN))
    assert picker.handle_event(key(pygame.K_RETURN)) == files[1 + columns][1]
    for _ in range(30):
        picker.handle_event(key(pygame.K_LEFT))
    assert picker.handle_event(key(pygame.K_KP_ENTER)) == files[0][1]
    picker.handle_event(key(pygame.K_END))
    assert picker.handle_event(key(pygame.K_RETURN)) == files[-1][1]


def test_typing_filters_by_title_and_about(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files)
    type_text(picker, "ODD scene 1")
    assert [card.title for card in picker.shown] == ["Scene 1", "Scene 11"]
    assert picker.handle_event(key(pygame.K_RETURN)) == files[1][1]
    picker.handle_event(key(pygame.K_BACKSPACE))
    assert len(picker.shown) == 6
    picker.handle_event(key(pygame.K_BACKSPACE, pygame.KMOD_LCTRL))
    assert len(picker.shown) == len(files)


def test_filter_is_cut_pasted_and_undone(files: list[tuple[str, Path]]) -> None:
    pygame.display.init()
    pygame.display.set_mode((64, 64))
    picker = draw_picker(files)
    type_text(picker, "odd")
    for code, typed in (("z", ""), ("y", "odd"), ("a", "odd"), ("x", ""), ("v", "odd"), ("v", "oddodd")):
        picker.handle_event(key(ord(code), pygame.KMOD_CTRL))
        assert picker.typed == typed
    picker.handle_event(key(pygame.K_BACKSPACE, pygame.KMOD_CTRL))
    assert picker.typed == "" and len(picker.shown) == len(files)


@pytest.mark.parametrize("text", ["s1", "Mine/S1", "scene 1"])
def test_exact_match_of_name_or_title_comes_first(files: list[tuple[str, Path]], text: str) -> None:
    picker = draw_picker([files[10], files[11], files[1]])
    type_text(picker, text)
    assert [card.title for card in picker.shown] == ["Scene 1", "Scene 10", "Scene 11"]
    assert picker.handle_event(key(pygame.K_RETURN)) == files[1][1]


def test_enter_without_matching_scenes_does_nothing(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files)
    type_text(picker, "teapot")
    picker.draw(pygame.Surface((900, 700)), 1.0)
    assert picker.handle_event(key(pygame.K_RETURN)) is None
    assert not picker.closed


def test_click_selects_the_card_below(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files)
    assert picker.handle_event(press(*card_centre(picker, 2))) is None
    assert picker.handle_event(release(*card_centre(picker, 2))) == files[2][1]
    picker.handle_event(press(*card_centre(picker, 2)))
    assert picker.handle_event(release(*card_centre(picker, 3))) is None
    picker.handle_event(move(*card_centre(picker, 4)))
    assert picker.chosen == 4


def test_wheel_scrolls_and_a_selected_card_is_scrolled_into_view(files: list[tuple[str, Path]]) -> None:
    picker = draw_picker(files, (400, 400))
    top = picker._rects[0][1].top
    picker.handle_event(wheel(-1))
    picker.draw(pygame.Surface((400, 400)), 1.0)
    assert picker._rects[0][1].top < top
    picker.handle_event(key(pygame.K_END))
    picker.draw(pygame.Surface((400, 400)), 1.0)
    assert picker._rects[-1][1].bottom <= 400


@pytest.mark.parametrize("event", [key(pygame.K_ESCAPE), key(pygame.K_o, pygame.KMOD_LCTRL)])
def test_escape_and_ctrl_o_close_the_picker(files: list[tuple[str, Path]], event: pygame.event.Event) -> None:
    picker = SceneBrowser(files)
    assert picker.handle_event(event) is None
    assert picker.closed


@pytest.mark.parametrize("size", [(1, 1), (30, 20), (200, 150), (640, 480)])
def test_picker_is_drawn_on_any_size(files: list[tuple[str, Path]], size: tuple[int, int]) -> None:
    picker = draw_picker(files, size, 5)
    assert picker.handle_event(key(pygame.K_DOWN)) is None
    draw_picker([], size, 2)


def test_thumbnail_of_a_burst_shows_it_in_flight() -> None:
    burst = "[world]\nduration = 2\n[[emitter]]\nposition = [0, 0]\ncount = 200\nradius = 0.05\n"
    scene = loads(burst + "velocity_min = [-5, -5]\nvelocity_max = [5, 5]\n")
    thumbnail = pygame.surfarray.array3d(draw_thumbnail(scene, (200, 200), Renderer(), 1.0)).astype(int)
    differs = np.abs(thumbnail - np.asarray(BACKGROUND)).max(axis=2) > 60
    assert differs[:80].any()
    assert differs[120:].any()


@pytest.mark.parametrize("name", each_shipped_scene())
def test_thumbnail_of_a_shipped_scene_is_not_empty(name: str) -> None:
    scene = read_scene(find(name)).scene
    assert scene is not None
    thumbnail = draw_thumbnail(scene, (200, 112), Renderer(), 0.7)
    assert np.ptp(pygame.surfarray.array3d(thumbnail).astype(int), axis=(0, 1)).max() > 60
