"""Fixtures of the end-to-end tests of the window: a private X server, input by xdotool, screenshots."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.driven.driving import DrivenWindow, OpenWindow, start_server
from tests.driven.xclient import LIBRARY

# For reference pictures drawn in this process; the driven windows set x11 themselves.
os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """Start an X server without a window manager, and return the name of its display."""
    missing = [name for name in ("Xvfb", "xdotool", "setxkbmap") if shutil.which(name) is None]
    missing += ["libX11"] if LIBRARY is None else []
    if missing:
        pytest.skip(f"driving a real window needs {' and '.join(missing)}")
    server, name = start_server()
    try:
        yield name
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def drive(display: str, tmp_path: Path) -> Iterator[OpenWindow]:
    """Return a function that opens a window by command-line arguments, in `tmp_path`; all are closed afterwards."""
    windows: list[DrivenWindow] = []

    def open_window(*arguments: str, **changes: str | None) -> DrivenWindow:
        windows.append(DrivenWindow(display, tmp_path, arguments, **changes))
        return windows[-1]

    try:
        yield open_window
    finally:
        for window in windows:
            window.end()


@pytest.fixture
def russian_display(display: str) -> Iterator[str]:
    """Give the keyboard of the X server a Russian layout during a test, and return the name of the display."""
    words = ["setxkbmap", "-display", display]
    subprocess.run([*words, "ru"], check=True)
    try:
        yield display
    finally:
        subprocess.run([*words, "us"], check=True)
