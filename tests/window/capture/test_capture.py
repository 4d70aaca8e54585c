"""Screenshots and films: complete files at the right paths with the added pictures."""

import re
import sys
import threading
from itertools import pairwise
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from PIL import Image

from sandbox.window.capture import recorder as capture
from sandbox.window.capture.controller import CaptureController
from sandbox.window.capture.gif import MAX_ERROR, PaletteQuantiser
from sandbox.window.capture.image_files import PictureError, fit_image, offscreen, rgb_pixels, safe_stem, screenshot
from sandbox.window.capture.recorder import recorder_for, recorder_in, size_within
from tests.films import gif_frames, mp4_frames

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

SIZE = (96, 54)
BACKGROUND, BALL = (20, 24, 31), (86, 180, 233)


def picture(x: int = 20, size: tuple[int, int] = SIZE, colour: tuple[int, int, int] = BALL) -> pygame.Surface:
    """Return a picture of a disc of radius 8 px at half the height."""
    surface = offscreen(size)
    surface.fill(BACKGROUND)
    pygame.draw.circle(surface, colour, (x, size[1] // 2), 8)
    return surface


def file_names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_screenshot_uses_the_first_free_number_and_equals_the_surface(tmp_path: Path) -> None:
    (tmp_path / "sandbox-bounce-2.png").write_bytes(b"mine")
    paths = [screenshot(picture(), tmp_path, "bounce") for _ in range(2)]
    assert [path.name for path in paths] == ["sandbox-bounce-1.png", "sandbox-bounce-3.png"]
    assert (tmp_path / "sandbox-bounce-2.png").read_bytes() == b"mine"
    with Image.open(paths[1]) as image:
        assert np.array_equal(np.asarray(image.convert("RGB")), rgb_pixels(picture(), SIZE))
    assert len(file_names(tmp_path)) == 3


def test_concurrent_screenshots_are_all_kept(tmp_path: Path) -> None:
    surface, barrier = picture(), threading.Barrier(8)

    def shoot() -> None:
        barrier.wait()
        screenshot(surface, tmp_path, "race")

    threads = [threading.Thread(target=shoot) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert file_names(tmp_path) == [f"sandbox-race-{n}.png" for n in range(1, 9)]


def test_screenshots_work_on_a_file_system_without_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", refuse)
    names = [screenshot(picture(), tmp_path, "a").name for _ in range(2)]
    assert names == file_names(tmp_path) == ["sandbox-a-1.png", "sandbox-a-2.png"]


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("bounce", "bounce"),
        ("tutorial/two balls", "tutorial-two-balls"),
        ("..", "scene"),
        ("", "scene"),
        ("Ωm_1", "m_1"),
    ],
)
def test_safe_stem_removes_unsafe_characters(name: str, stem: str) -> None:
    assert safe_stem(name) == stem
    assert re.fullmatch(r"[A-Za-z0-9_-]{1,60}", safe_stem(name * 100))


def test_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="cannot be written: No such file"):
        screenshot(picture(), tmp_path / "nowhere", "a")
    for suffix in (".gif", ".mp4"):
        with pytest.raises(PictureError, match="cannot be written: No such file"):
            recorder_for(tmp_path / "nowhere" / f"a{suffix}", SIZE, 30.0)


@pytest.mark.parametrize(("elapsed", "is_named"), [(0.04, False), (0.2, True)])
def test_notice_of_a_film_with_few_pictures_names_the_export(elapsed: float, is_named: bool, tmp_path: Path) -> None:
    notices: list[str] = []
    controller = CaptureController(tmp_path, ".gif", lambda text, _: notices.append(text))
    controller.start_recording((64, 48), "film")
    for _ in range(10):
        controller.update(lambda: pygame.Surface((64, 48)), elapsed)
    controller.stop_recording()
    (notice,) = notices
    assert notice.startswith(f"recorded: {tmp_path / 'sandbox-film'}")
    assert ("sandbox export" in notice, "5 pictures a second" in notice) == (is_named, is_named)


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_recorder_leaves_one_file_or_none(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"film{suffix}"
    recorder = recorder_for(path, SIZE, 30.0)
    recorder.add(picture(), 0.1)
    assert not path.exists()
    recorder.cancel()
    recorder.cancel()
    assert file_names(tmp_path) == []

    path.write_bytes(b"old")
    recorder = recorder_for(path, SIZE, 30.0)
    recorder.add(picture(), 0.1)
    assert path.read_bytes() == b"old"
    assert recorder.close() == path
    recorder.cancel()
    assert file_names(tmp_path) == [path.name]
    assert len(path.read_bytes()) > 100  # more than any header alone


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_film_without_pictures_is_an_error_and_leaves_no_file(suffix: str, tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / f"film{suffix}", SIZE, 30.0)
    with pytest.raises(PictureError, match="at least one frame"):
        recorder.close()
    assert file_names(tmp_path) == []


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_recorder_in_a_folder_uses_the_first_free_number(suffix: str, tmp_path: Path) -> None:
    (tmp_path / f"sandbox-a-b-1{suffix}").touch()
    recorder = recorder_in(tmp_path, "a b", suffix, SIZE, 30.0)
    recorder.add(picture(), 0.1)
    assert recorder.close() == tmp_path / f"sandbox-a-b-2{suffix}"


def test_gif_keeps_every_picture_and_its_duration(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 30.0)
    positions = [20, 24, 24, 60, 61]
    for x in positions:
        recorder.add(picture(x), 1 / 30)
    frames, shown = gif_frames(recorder.close())
    assert shown == [30, 40, 30, 30, 40]  # whole 0.01 s at each end: 33.3, 66.7, 100, 133.3, 166.7 ms
    for x, frame in zip(positions, frames, strict=True):
        assert np.array_equal(frame, rgb_pixels(picture(x), SIZE))  # two colours fit any palette
    with Image.open(tmp_path / "film.gif") as image:
        assert image.info["loop"] == 0


@pytest.mark.parametrize("fps", [10, 24, 30, 50])
def test_gif_durations_sum_to_the_real_time(fps: int, tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.gif", SIZE, fps)
    for k in range(fps):
        recorder.add(picture(10 + k), 1 / fps)
    _, shown = gif_frames(recorder.close())
    assert (len(shown), sum(shown)) == (fps, 1000)
    assert max(shown) - min(shown) <= 10  # one unit of a gif


def test_gif_drops_frames_shorter_than_viewers_support(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 60.0)
    for k in range(120):
        recorder.add(picture(10 + k % 60), 1 / 60)
    frames, shown = gif_frames(recorder.close())
    assert (len(frames), sum(shown)) == (60, 2000)
    assert np.array_equal(frames[1], rgb_pixels(picture(12), SIZE))


def test_gif_gets_a_new_palette_for_new_colours(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 30.0)
    colours = [BALL, (255, 40, 40), (240, 228, 66)]
    for colour in colours:
        recorder.add(picture(colour=colour), 0.1)
    frames, _ = gif_frames(recorder.close())
    assert [tuple(frame[27, 20]) for frame in frames] == colours
    assert {tuple(frame[0, 0]) for frame in frames} == {BACKGROUND}


def test_palette_is_reused_while_it_fits() -> None:
    quantiser = PaletteQuantiser(255)
    tables = []
    for colour in (BALL, BALL, (255, 40, 40), BALL):
        pixels = rgb_pixels(picture(colour=colour), SIZE)
        index = quantiser.quantise(pixels, pixels)
        tables.append(quantiser.table)
        assert np.array_equal(tables[-1][index], pixels)
    assert [now is before for before, now in pairwise(tables)] == [True, False, True]


NEW_COLOURS = [(255, 255, 255), (255, 0, 0), (0, 255, 0)]
"""Colours not near a colour of the ramp: each needs a new palette."""


@pytest.mark.parametrize("colours", [NEW_COLOURS[:1] * 6, NEW_COLOURS])
def test_gif_of_many_colours_is_accurate_and_does_not_flicker(
    colours: list[tuple[int, int, int]], tmp_path: Path
) -> None:
    rows, columns = np.mgrid[:54, :96]
    ramp = np.stack((columns * 2, rows * 4, 255 - columns - rows), axis=-1).astype(np.uint8)
    ramp[:20] = BACKGROUND  # the moving square uncovers no new colours
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 30.0)
    for k, colour in enumerate(colours):
        surface = pygame.image.frombytes(ramp.tobytes(), SIZE, "RGB")
        pygame.draw.rect(surface, colour, (10 * k, 2, 16, 16))
        recorder.add(surface, 0.04)
    frames, _ = gif_frames(recorder.close())
    error = np.abs(frames[0][20:] - ramp[20:]).max()
    assert error <= MAX_ERROR  # over 3,000 colours in 255 entries
    for k, (frame, colour) in enumerate(zip(frames, colours, strict=True)):
        assert tuple(frame[10, 10 * k + 5]) == colour
        assert np.array_equal(frame[20:], frames[0][20:])  # unchanged pixels keep exactly the same colour


def test_gif_has_a_frame_limit_and_keeps_earlier_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture, "MAX_GIF_FRAMES", 3)
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 30.0)
    for k in range(3):
        recorder.add(picture(10 + k), 0.05)
    with pytest.raises(PictureError, match="at most 3 frames"):
        recorder.add(picture(), 0.05)
    assert gif_frames(recorder.close())[1] == [50, 50, 50]


def test_full_disk_is_an_error_and_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = recorder_for(tmp_path / "film.gif", SIZE, 30.0)
    recorder.add(picture(), 0.1)

    def fail(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder._stream, "write", fail)
    with pytest.raises(PictureError, match="No space left on device"):
        recorder.close()
    assert file_names(tmp_path) == []


def test_mp4_decodes_to_the_added_pictures(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.mp4", (160, 90), 25.0)
    positions = list(range(20, 140, 4))
    for x in positions:
        recorder.add(picture(x, (160, 90)), 1 / 25)
    frames, about = mp4_frames(recorder.close())
    assert len(frames) == 30
    assert all(word in about for word in ("h264", "yuv420p", "160x90", "25 fps"))
    for x, frame in zip(positions, frames, strict=True):
        assert np.abs(frame[45, x] - BALL).max() <= 12  # of 255: a lossy codec, colours at half resolution
        assert np.abs(frame[5, 5] - BACKGROUND).max() <= 6  # of 255: a flat area


def test_mp4_repeats_and_drops_pictures_to_keep_real_time(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.mp4", SIZE, 30.0)
    for seconds in (0.5, 0.001, 0.001, 0.498):
        recorder.add(picture(), seconds)
    frames, _ = mp4_frames(recorder.close())
    assert len(frames) == 30


def test_mp4_of_odd_size_is_cropped_by_a_row_and_a_column(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.mp4", (97, 55), 30.0)
    recorder.add(picture(size=(97, 55)), 0.1)
    frames, _ = mp4_frames(recorder.close())
    assert [frame.shape for frame in frames] == [(54, 96, 3)] * 3


def test_mp4_without_its_extra_names_the_package_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(capture, "can_make_mp4", lambda: False)
    with pytest.raises(PictureError, match=r'pip install -e "\.\[video\]"'):
        recorder_for(tmp_path / "film.mp4", SIZE, 30.0)
    assert file_names(tmp_path) == []


def test_failing_ffmpeg_is_reported_with_its_own_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'disk on fire' >&2\ncat > /dev/null\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(program))
    recorder = recorder_for(tmp_path / "film.mp4", SIZE, 30.0)
    recorder.add(picture(), 0.1)
    with pytest.raises(PictureError, match=r"^ffmpeg: disk on fire$"):
        recorder.close()
    assert file_names(tmp_path) == ["ffmpeg"]


def test_ffmpeg_killed_while_recording_is_an_error(tmp_path: Path) -> None:
    recorder = recorder_for(tmp_path / "film.mp4", (640, 360), 30.0)
    recorder._process.kill()
    recorder._process.wait()
    with pytest.raises(PictureError, match=r"^ffmpeg: "):
        for _ in range(4):  # a pipe holds less than one such picture
            recorder.add(picture(size=(640, 360)), 0.1)
    with pytest.raises(PictureError):
        recorder.close()
    assert file_names(tmp_path) == []


@pytest.mark.parametrize(("suffix", "word"), [(".avi", ".gif or .mp4"), ("", ".gif or .mp4")])
def test_other_suffixes_are_refused(suffix: str, word: str, tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=word):
        recorder_for(tmp_path / f"film{suffix}", SIZE, 30.0)


@pytest.mark.parametrize(("size", "fps"), [((0, 10), 30.0), ((10, 10), 0.0), ((10, 10), float("nan"))])
def test_impossible_films_are_refused(size: tuple[int, int], fps: float, tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="cannot record"):
        recorder_for(tmp_path / "film.gif", size, fps)


def test_larger_surface_is_downsampled_by_averaging(tmp_path: Path) -> None:
    large = offscreen((192, 108))
    large.fill((0, 0, 0))
    large.fill((200, 100, 0), (0, 0, 192, 1))
    assert tuple(rgb_pixels(large, SIZE)[0, 10]) == (100, 50, 0)
    assert tuple(rgb_pixels(large, SIZE)[1, 10]) == (0, 0, 0)


def test_other_aspect_ratios_get_bars() -> None:
    white = offscreen((50, 50))
    white.fill((255, 255, 255))
    pixels = rgb_pixels(white, (100, 50))
    assert (pixels[:, 25:75] == 255).all()
    assert (pixels[:, :25] == BACKGROUND).all()
    assert (pixels[:, 75:] == BACKGROUND).all()
    assert fit_image(white, (50, 50)) is white


@pytest.mark.parametrize(
    ("size", "width", "within"),
    [((1920, 1080), 960, (960, 540)), ((801, 601), 4000, (800, 600)), ((3000, 1), 100, (100, 2))],
)
def test_size_within_a_width_has_even_sides(size: tuple[int, int], width: int, within: tuple[int, int]) -> None:
    assert size_within(size, width) == within
