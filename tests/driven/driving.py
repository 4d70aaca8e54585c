"""Driver of a real window: keys and mouse by xdotool on a real X server, screenshots as output.

No fixed sleeps: each wait is for a condition on the screen, on standard output or on disk. The time limit is so
generous that it ends only waits that would never succeed.
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
"""Time limit of a wait, s."""
SCREEN = (1024, 768)
SIZE = (900, 600)
"""Size of the window, px; it is in the upper left corner of the screen."""
MOUSE_START = (2, 2)
"""Initial position of the mouse, px, where it covers nothing. It is inside of the window from the start: when the mouse
enters, SDL reads which of Ctrl, Alt and Shift are down, and on a busy machine that is ahead of its queue of keys."""

Shot = npt.NDArray[np.uint8]
"""Screenshot, (height, width, 3), sRGB."""
Result = TypeVar("Result")


def environment(**changes: str | None) -> dict[str, str]:
    """Return the environment of a new window process: this process's with some changes; None removes a variable."""
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


class DrivenWindow:
    """A window of a child process, controlled by xdotool."""

    def __init__(self, display: str, folder: Path, arguments: tuple[str, ...], **changes: str | None) -> None:
        """Open the window, and wait until it shows a picture.

        Args:
            display: Display of the X server.
            folder: Working folder of the process; its output is written there too.
            arguments: Arguments of the command line.
            changes: Changes to the environment.
        """
        self.display, self.folder = display, folder
        self.size = SIZE
        self._held: set[str] = set()
        self._env = environment(**{"SDL_VIDEODRIVER": "x11", "DISPLAY": display, **changes})
        self._out, self._err = folder / "stdout.txt", folder / "stderr.txt"
        size = f"{SIZE[0]}x{SIZE[1]}"
        self.mouse(MOUSE_START)
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                command(*arguments, "--size", size), cwd=folder, env=self._env, stdout=out, stderr=err
            )
        try:
            self.window = self.wait_for(self._find, "a window")
            self.wait_until(lambda shot: len(np.unique(shot.reshape(-1, 3)[::97], axis=0)) > 2, "anything to see")
            self.window = self._find()  # SDL may have recreated it for its first picture
            self.focus()
        except BaseException:
            self.end()  # no caller has a reference to it yet
            raise

    def _find(self) -> int:
        # The process id too: the window of a process that has just ended may exist a moment longer.
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
        """Run an xdotool command, and wait until the server has handled it: it may serve a later client first."""
        done = self._run(*words, "getmouselocation")  # the server replies to this one
        # The command may close the window, also while xdotool queries the window under the mouse.
        closed = "BadWindow" in done.stderr and words[0] != "windowfocus"
        assert done.returncode == 0 or closed, f"xdotool {words}: {done.stderr}"

    # Input

    def key(self, *names: str) -> None:
        """Press keys one after the other, by xdotool's names; without a delay, SDL takes them for key repeats."""
        self._do("key", "--delay", 20, *names)

    def hold(self, name: str) -> None:
        """Press a key and keep it down."""
        self._held.add(name)
        self._do("keydown", name)

    def release_key(self, name: str) -> None:
        """Release a held key."""
        self._do("keyup", name)
        self._held.discard(name)

    def focus(self) -> None:
        """Give the window the keyboard focus."""
        self._do("windowfocus", self.window)

    def type(self, text: str) -> None:
        """Press the keys of a text of lower-case letters and blanks."""
        self.key(*("space" if letter == " " else letter for letter in text))

    def mouse(self, point: tuple[float, float]) -> None:
        """Move the mouse to a point of the window, px."""
        self._do("mousemove", round(point[0]), round(point[1]))

    def press(self, point: tuple[float, float], button: int = 1) -> None:
        self._do("mousemove", round(point[0]), round(point[1]), "mousedown", button)

    def release(self, button: int = 1) -> None:
        self._do("mouseup", button)

    def click(self, point: tuple[float, float], button: int = 1) -> None:
        """Press and release at a point, usually within one frame."""
        self._do("mousemove", round(point[0]), round(point[1]), "mousedown", button, "mouseup", button)

    def press_and_move(self, start: tuple[float, float], end: tuple[float, float], button: int = 1) -> None:
        """Press at one point and move to another in a few moves, without releasing the button."""
        self.press(start, button)
        words: list[object] = []
        for fraction in (0.25, 0.5, 0.75, 1.0):
            words += ["mousemove", *(round(a + (b - a) * fraction) for a, b in zip(start, end, strict=True))]
        self._do(*words)

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: int = 1) -> None:
        """Press at one point, and release at another."""
        self.press_and_move(start, end, button)
        self.release(button)

    def wheel(self, point: tuple[float, float], notches: int) -> None:
        """Turn the wheel over a point; upwards if `notches` is positive."""
        button = 4 if notches > 0 else 5
        self._do("mousemove", *map(round, point), *("click", button) * abs(notches))

    def resize(self, width: int, height: int) -> None:
        self.size = width, height
        self._do("windowsize", self.window, width, height)

    def move(self, corner: tuple[int, int]) -> None:
        """Move the window's upper left corner to a point of the screen, px."""
        self._do("windowmove", self.window, *corner)

    # Output

    def shot(self) -> Shot:
        """Return a screenshot of the window."""
        whole = ImageGrab.grab(xdisplay=self.display)
        return np.asarray(whole.convert("RGB").crop((0, 0, *self.size)))

    def title(self) -> str:
        return self._xdotool("getwindowname", self.window)

    def stdout_lines(self) -> list[str]:
        """Return the lines of standard output so far."""
        return self._out.read_text(encoding="utf-8").splitlines()

    def stderr_text(self) -> str:
        """Return standard error so far."""
        return self._err.read_text(encoding="utf-8")

    def session(self, keys: str = "ctrl+s") -> Recording:
        """Save the session by Ctrl+S and return it; all earlier input has been handled by then.

        On a layout without Latin letters, `keys` names the key by its number instead.
        """
        before = len(self.stdout_lines())
        self.key(keys)
        line = self.wait_for(
            lambda: next((x for x in self.stdout_lines()[before:] if x.startswith("session: ")), ""), "a file"
        )
        return Recording.load(self.folder / line.removeprefix("session: "))

    def step_number(self) -> int:
        """Return the number of steps up to the displayed time, by the saved session."""
        session = self.session()
        time = session.duration if session.at is None else session.at
        return round(time / session.settings.dt)

    # Waiting

    def wait_for(self, condition: Callable[[], Result], what: str) -> Result:
        """Poll a condition until its result is true, and return the result; `what` names it in a failure."""
        deadline = monotonic() + LIMIT
        while not (result := condition()):
            assert self.process.poll() is None, f"{what}: the window has closed: {self.stderr_text()}"
            if monotonic() > deadline:
                self._keep_picture()
                raise AssertionError(f"timeout: {what}; see {self.folder / 'timeout.png'}")
            sleep(0.02)
        return result

    def wait_until(self, condition: Callable[[Shot], Result], what: str) -> Shot:
        """Take screenshots until a condition holds for one, and return that screenshot."""
        latest: list[Shot] = []

        def check() -> Result:
            latest[:] = [self.shot()]
            return condition(latest[0])

        self.wait_for(check, what)
        return latest[0]

    def _keep_picture(self) -> None:
        Image.fromarray(self.shot()).save(self.folder / "timeout.png")

    def exit_status(self) -> int:
        """Wait for the process to exit, and return its exit status."""
        return self.process.wait(LIMIT)

    def end(self) -> None:
        """Kill the process if it still runs, and release all keys and buttons."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(LIMIT)
        # The next window of the same server must not find keys or buttons down.
        for name in sorted(self._held):
            self._run("keyup", name)
        self._run("mouseup", 1, "mouseup", 3)


def start_server() -> tuple[subprocess.Popen[bytes], str]:
    """Start an X server on a free display, and return its process and the name of the display.

    A server that chooses its display takes no lock: two that start together may choose the same one. So the number
    is derived from this process's id.
    """
    number = 100 + os.getpid() % 50_000
    read, write = os.pipe()
    screen = f"{SCREEN[0]}x{SCREEN[1]}x24"
    # -r: no key repeats, however late its release comes on a busy machine. -noreset: the server does not restart
    # after its last window has closed, as the next window might open meanwhile.
    quiet = ("-nolisten", "tcp", "-r", "-noreset")
    words = ["Xvfb", f":{number}", "-displayfd", str(write), "-screen", "0", screen, *quiet]
    server = subprocess.Popen(words, pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as answer:
        reply = answer.readline().strip()
    assert reply == str(number), "Xvfb did not start"
    return server, f":{number}"


OpenWindow = Callable[..., DrivenWindow]
"""Function that opens a window by command-line arguments; keywords change its environment."""
