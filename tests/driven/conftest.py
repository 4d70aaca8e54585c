"""The window driven for real: an X server of its own, xdotool for hands, screenshots for eyes."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.driven.driving import Driven, Play, start_server
from tests.driven.xclient import LIBRARY

# For what tests draw in this process to compare with; the windows that they drive say x11 themselves.
os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """An X server without a window manager; its display's name."""
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    missing += ["libX11"] if LIBRARY is None else []
    if missing:
        pytest.skip(f"driving a window for real needs {' and '.join(missing)}")
    server, name = start_server()
    try:
        yield name
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def drive(display: str, tmp_path: Path) -> Iterator[Play]:
    """Open a window by the words of a command line, working in a folder of its own; it is ended afterwards."""
    driven: list[Driven] = []

    def opened(*arguments: str, **changes: str | None) -> Driven:
        driven.append(Driven(display, tmp_path, arguments, **changes))
        return driven[-1]

    try:
        yield opened
    finally:
        for each in driven:
            each.end()
