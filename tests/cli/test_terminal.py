"""Output on a terminal of 80 columns: nothing is cut off or folded within a word."""

import fcntl
import os
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tests.cli.calling import write_scene

pytestmark = pytest.mark.full  # child processes and command lines that run long


def terminal_output(*arguments: str, cwd: Path) -> list[str]:
    """Call on a pseudo-terminal of 80 columns; return the lines of stdout without escape sequences."""
    screen, terminal = os.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR")}
    with subprocess.Popen(
        [sys.executable, "-m", "sandbox", *arguments],
        stdout=terminal,
        stderr=subprocess.DEVNULL,
        cwd=cwd,
        env={**environment, "TERM": "xterm"},
    ) as command:
        os.close(terminal)
        output = b""
        try:
            while more := os.read(screen, 65536):
                output += more
        except OSError:
            pass  # end of output on Linux
        finally:
            os.close(screen)
        assert command.wait(120) == 0
    return re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", output.decode()).splitlines()


def test_table_of_many_columns_shows_all_of_them(tmp_path: Path) -> None:
    name = "a scene with a name that is long, and longer, and longer than a line can be.toml"
    write_scene(tmp_path, name=name)
    sweeps = [
        f"solver.{key}" for key in ("dt=0.01,0.005", "iterations=5,10", "persistence=2,3", "half_kick=true,false")
    ]
    out = terminal_output("run", name, *(word for sweep in sweeps for word in ("--sweep", sweep)), cwd=tmp_path)
    assert out[0] == name
    assert " ".join(out[1].split()) == (
        "engine dt iterations persistence half_kick status × real time energy, J first contact, s "
        "final position, m contacts missed"
    )
    assert len([line for line in out if line.startswith("pymunk")]) == 16
    assert "missed: contacts that the engine missed" in " ".join(out[18:])
    assert not any("…" in line for line in out)


def test_table_of_several_scenes_fits_the_terminal(tmp_path: Path) -> None:
    out = terminal_output("run", "bounce", "bullet", "--set", "world.duration=0.01", cwd=tmp_path)
    assert [line.split()[0] for line in out[:3]] == ["scene", "bounce", "bullet"]
    assert max(map(len, out)) <= 80


def test_warnings_are_folded_between_words(tmp_path: Path) -> None:
    out = terminal_output("check", "bullet", cwd=tmp_path)
    assert max(map(len, out)) <= 80
    begin = next(k for k, line in enumerate(out) if line.startswith("  warning: "))
    folded = " ".join(line.strip() for line in out[begin:])
    assert folded.endswith(
        "0.1 m per substep, and tunnel through it undetected: odds up to 80 %; dt <= 0.0002 s is safe"
    )
