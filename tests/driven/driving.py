"""Driving a window as a person does: a real X server, real keys and a real mouse; what is seen is a screenshot.

Nothing here sleeps for a fixed time to be on the safe side: each wait is for something that is seen, said or written,
with a limit so generous that it only ends what would never come.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageGrab

from sandbox.recording import Recording

LIMIT = 250.0
"""s, after which what is waited for will never come"""
SCREEN = (1024, 768)
SIZE = (900, 600)
"""px, of the window, in the upper left corner of the screen"""
ASIDE = (2, 2)
"""Where the mouse is in nobody's way. It is in the window from the start: when it enters, SDL looks which of Ctrl, Alt
and Shift are down at that moment, which on a busy machine is ahead of the keys that it has yet to read."""

Shot = npt.NDArray[np.uint8]
"""What is seen, (height, width, 3), sRGB."""
Seen = TypeVar("Seen")


def environment(**changes: str | None) -> dict[str, str]:
    """Return this process's environment for a window of its own; what is changed to None is left out."""
    base: dict[str, str | None] = {
        **os.environ,
        "SDL_AUDIODRIVER": "dummy",
        "SDL_VIDEO_WINDOW_POS": "0,0",
        "NUMBA_DISABLE_JIT": "1",  # for a body or two, compiling takes longer than it saves
        "PYTHONUNBUFFERED": "1",
        **changes,
    }
    return {key: value for key, value in base.items() if value is not None}


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "sandbox", *arguments]


class Driven:
    """A window that is being driven."""

    def __init__(self, display: str, folder: Path, arguments: tuple[str, ...], **changes: str | None) -> None:
        """Open it, and wait until something is seen in it.

        Args:
            display: of the X server.
            folder: what it works in, and writes its output into.
            arguments: of the command line.
            changes: to the environment.
        """
        self.display, self.folder = display, folder
        self.size = SIZE
        self._held: set[str] = set()
        self._env = environment(**{"SDL_VIDEODRIVER": "x11", "DISPLAY": display, **changes})
        self._out, self._err = folder / "stdout.txt", folder / "stderr.txt"
        size = f"{SIZE[0]}x{SIZE[1]}"
        self.mouse(ASIDE)
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                command(*arguments, "--size", size), cwd=folder, env=self._env, stdout=out, stderr=err
            )
        try:
            self.window = self.wait_for(self._find, "a window")
            self.wait_until(lambda shot: len(np.unique(shot.reshape(-1, 3)[::97], axis=0)) > 2, "anything to see")
            self.window = self._find()  # SDL may have made it anew for its first picture
            self.focus()
        except BaseException:
            self.end()  # nobody else knows of it yet
            raise

    def _find(self) -> int:
        # By its process too: the window of one that has just ended may be there a moment longer.
        found = self._run("search", "--all", "--onlyvisible", "--pid", self.process.pid, "--class", "sandbox")
        return int(found.stdout.split()[0]) if found.stdout.split() else 0

    def _run(self, *arguments: object) -> subprocess.CompletedProcess[str]:
        words = ["xdotool", *map(str, arguments)]
        return subprocess.run(words, env=self._env, capture_output=True, text=True, timeout=LIMIT, check=False)

    def _xdotool(self, *arguments: object) -> str:
        done = self._run(*arguments)
        assert done.returncode == 0, f"xdotool {arguments}: {done.stderr}"
        return done.stdout.strip()

    def _do(self, *words: object) -> None:
        """Do something, and make sure that the server has taken it in: it may serve who comes later first."""
        done = self._run(*words, "getmouselocation")  # which it answers
        # What is done may close the window, also while xdotool asks for what is under the mouse.
        closed = "BadWindow" in done.stderr and words[0] != "windowfocus"
        assert done.returncode == 0 or closed, f"xdotool {words}: {done.stderr}"

    # What a person does

    def key(self, *names: str) -> None:
        """Press keys one after the other, as xdotool names them; in a hurry, SDL takes them for one that repeats."""
        self._do("key", "--delay", 20, *names)

    def hold(self, name: str) -> None:
        """Press a key, and keep it down."""
        self._held.add(name)
        self._do("keydown", name)

    def let_go(self, name: str) -> None:
        """Release a key that is held."""
        self._do("keyup", name)
        self._held.discard(name)

    def focus(self) -> None:
        """Give the window the keyboard."""
        self._do("windowfocus", self.window)

    def type(self, text: str) -> None:
        """Press the keys that write lower-case letters and blanks."""
        self.key(*("space" if letter == " " else letter for letter in text))

    def mouse(self, at: tuple[float, float]) -> None:
        """Move the mouse to a place in the window, px."""
        self._do("mousemove", round(at[0]), round(at[1]))

    def press(self, at: tuple[float, float], button: int = 1) -> None:
        self._do("mousemove", round(at[0]), round(at[1]), "mousedown", button)

    def release(self, button: int = 1) -> None:
        self._do("mouseup", button)

    def click(self, at: tuple[float, float], button: int = 1) -> None:
        """Press and release at a place, both within one picture or nearly so."""
        self._do("mousemove", round(at[0]), round(at[1]), "mousedown", button, "mouseup", button)

    def pull(self, start: tuple[float, float], end: tuple[float, float], button: int = 1) -> None:
        """Press at one place and go to another, in a few moves, without letting go."""
        self.press(start, button)
        words: list[object] = []
        for share in (0.25, 0.5, 0.75, 1.0):
            words += ["mousemove", *(round(a + (b - a) * share) for a, b in zip(start, end, strict=True))]
        self._do(*words)

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: int = 1) -> None:
        """Press at one place, and let go at another."""
        self.pull(start, end, button)
        self.release(button)

    def wheel(self, at: tuple[float, float], notches: int) -> None:
        """Turn the wheel over a place; upwards where `notches` is positive."""
        button = 4 if notches > 0 else 5
        self._do("mousemove", *map(round, at), *("click", button) * abs(notches))

    def resize(self, width: int, height: int) -> None:
        self.size = width, height
        self._do("windowsize", self.window, width, height)

    # What is seen, said and written

    def shot(self) -> Shot:
        """Return what the window shows."""
        whole = ImageGrab.grab(xdisplay=self.display)
        return np.asarray(whole.convert("RGB").crop((0, 0, *self.size)))

    def title(self) -> str:
        return self._xdotool("getwindowname", self.window)

    def said(self) -> list[str]:
        """Return the lines on standard output so far."""
        return self._out.read_text(encoding="utf-8").splitlines()

    def complained(self) -> str:
        """Return what stands on standard error."""
        return self._err.read_text(encoding="utf-8")

    def session(self) -> Recording:
        """Save the session by Ctrl+S and return it; by then all that was done before has been taken in."""
        before = len(self.said())
        self.key("ctrl+s")
        line = self.wait_for(lambda: next((x for x in self.said()[before:] if x.startswith("session: ")), ""), "a file")
        return Recording.load(self.folder / line.removeprefix("session: "))

    def settled(self) -> Shot:
        """Return a picture of all that was done before: the second file is written a turn after the first."""
        self.session()
        self.session()
        return self.shot()

    def step_number(self) -> int:
        """Return how many steps were made up to the moment that is shown, as the session has it."""
        session = self.session()
        moment = session.duration if session.at is None else session.at
        return round(moment / session.settings.dt)

    # Waiting

    def wait_for(self, condition: Callable[[], Seen], what: str) -> Seen:
        """Ask again and again until the answer is true, and return it."""
        until = monotonic() + LIMIT
        while not (answer := condition()):
            assert self.process.poll() is None, f"{what}: the window has gone: {self.complained()}"
            if monotonic() > until:
                self._keep_picture()
                raise AssertionError(f"{what} never came; see {self.folder / 'at-last.png'}")
            sleep(0.02)
        return answer

    def wait_until(self, condition: Callable[[Shot], Seen], what: str) -> Shot:
        """Look again and again until a condition holds for what is seen, and return that."""
        seen: list[Shot] = []

        def look() -> Seen:
            seen[:] = [self.shot()]
            return condition(seen[0])

        self.wait_for(look, what)
        return seen[0]

    def _keep_picture(self) -> None:
        Image.fromarray(self.shot()).save(self.folder / "at-last.png")

    def status(self) -> int:
        """Wait for the process to end by itself, and return its exit status."""
        return self.process.wait(LIMIT)

    def end(self) -> None:
        """End what is left of it, with nothing held down."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(LIMIT)
        # The next window of the same server must not find keys or buttons down.
        for name in sorted(self._held):
            self._run("keyup", name)
        self._run("mouseup", 1, "mouseup", 3)


def start_server() -> tuple[subprocess.Popen[bytes], str]:
    """Start an X server on a display of its own; return it, and the display's name.

    A server that is left to choose takes no lock: two that start together may take the same display. So this process's
    number, which no other has, says which.
    """
    number = 100 + os.getpid() % 50_000
    read, write = os.pipe()
    screen = f"{SCREEN[0]}x{SCREEN[1]}x24"
    # -r: no key repeats by itself, however late its release comes on a busy machine. -noreset: it stays as it is
    # between one window and the next, who might come while it starts anew.
    quiet = ("-nolisten", "tcp", "-r", "-noreset")
    words = ["Xvfb", f":{number}", "-displayfd", str(write), "-screen", "0", screen, *quiet]
    server = subprocess.Popen(words, pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as answer:
        said = answer.readline().strip()
    assert said == str(number), "Xvfb did not start"
    return server, f":{number}"


Play = Callable[..., Driven]
"""Opens a window by the words of a command line; keywords change its environment."""
