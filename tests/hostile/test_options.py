"""Hostile values of every option and argument of every command: a short message and status 2, never a traceback."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest

from sandbox.cli.main import COMMANDS, call, cli

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

LONG = 10**6
"""characters of a long value"""
MANY = 10**5
"""names in a long list"""
MAX_MESSAGE = 2000
"""maximum characters of the message about one hostile value"""
MISSING = "no-such-scene"
"""name in place of a scene: the command is refused with any options, so it never runs for long"""

TEXTS = (
    "", "-", "\x1b[31m", "a\0b", "\udcff", "ü" * LONG, ",".join(f"a{k}" for k in range(MANY)), "x=" + "{a=" * MANY,
    "solver.dt=0:1:" + "9" * 5000, "x[1]" * MANY + "=1", "nan",
)  # fmt: skip
NUMBERS = ("", "x", "nan", "-inf", "1e400", "-1", "9" * LONG, "0." + "0" * LONG + "1", "٣", "a\0b")
PATHS = (
    "", "x" * 300 + ".png", "x/" * 3000 + "y.html", "a\0b", "\udcff.png", "/dev/null/x.png", "file/x", "loop",
    "folder",
)  # fmt: skip
"""One value of each class: empty, of the wrong type, beyond all bounds, no text, no character, very long, unusable."""


def commands() -> dict[str, click.Command]:
    """Return every command by name."""
    return {name: cli.get_command(click.Context(cli), name) for name in COMMANDS}


def values_for(parameter: click.Parameter) -> tuple[str, ...]:
    """Return hostile values for the type of a parameter."""
    if isinstance(parameter.type, click.types.IntParamType | click.types.FloatParamType):
        return NUMBERS
    if isinstance(parameter.type, click.Path) or parameter.name in ("targets", "minimise"):
        return PATHS
    if parameter.name == "place":  # a file and a folder are places for the schema
        return tuple(path for path in PATHS if path not in ("file", "folder"))
    if parameter.name == "table":  # each value builds the schema, which takes a second
        return TEXTS[::3]
    return TEXTS + PATHS if isinstance(parameter, click.Argument) else TEXTS


def refused_arguments(name: str, command: click.Command) -> list[str]:
    """Return arguments with which a command is refused, with any options."""
    if any(isinstance(parameter, click.Argument) for parameter in command.params) and name != "schema":
        out = ["--out", "page.html"] if name == "report" else []
        return [MISSING, *out]
    return ["--axes", "none"] if name == "extremes" else []


def options() -> Iterator[Any]:
    """Yield each command with each of its parameters."""
    for name, command in commands().items():
        for parameter in command.params:
            if not getattr(parameter, "is_flag", False):
                yield pytest.param(name, command, parameter, id=f"{name} {parameter.name}")


def abbreviated(value: str) -> str:
    return f"{value[:20]}, {len(value)} long"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with files of several kinds."""
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "broken").symlink_to(tmp_path / "nothing")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    for suffix in ("png", "json"):
        os.mkfifo(tmp_path / f"pipe.{suffix}")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("name", "command", "parameter"), list(options()))
def test_hostile_value_gives_a_short_message_and_status_2(name, command, parameter, capfd):
    base = refused_arguments(name, command)
    for value in values_for(parameter):
        if isinstance(parameter, click.Argument):
            arguments = [name, *base[1:], "--", value]
        else:
            arguments = [name, f"{parameter.opts[0]}={value}", *base]
        status = call(arguments)
        err = capfd.readouterr().err
        assert (status, abbreviated(value)) == (2, abbreviated(value))
        assert err.strip(), abbreviated(value)
        assert len(err) <= MAX_MESSAGE, (abbreviated(value), len(err), err[:500])


@pytest.mark.parametrize("command", list(commands().items()), ids=lambda item: item[0])
def test_unknown_option_and_value_of_a_flag_are_refused(command, capfd):
    name, definition = command
    flags = [f"{each.opts[0]}={'x' * LONG}" for each in definition.params if getattr(each, "is_flag", False)]
    for option in (f"--{'x' * LONG}", f"-{'x' * MANY}", "--\n", *flags):
        assert call([name, option, *refused_arguments(name, definition)]) == 2, option[:20]
        assert 0 < len(capfd.readouterr().err) <= MAX_MESSAGE


@pytest.mark.parametrize("name", TEXTS)
def test_hostile_command_is_refused(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert call([name]) == 2
    assert 0 < len(capfd.readouterr().err) <= MAX_MESSAGE


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("run bounce", "--out"), ("run bounce", "--plot"), ("compare bounce", "--out"), ("tradeoff bounce", "--out"),
        ("compare bounce --force", "--minimise"), ("tradeoff bounce", "--plot"),
        ("extremes", "--out"), ("extremes", "--against"), ("match 9-ball", "--out"), ("report bounce", "--out"),
        ("play bounce", "--record"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("path", ["x" * 300 + ".png", "/dev/null/x.png", "file/x.svg"])
def test_path_that_cannot_be_used_is_refused_before_the_work(command, option, path, capfd):
    assert call([*command.split(), option, path]) == 2
    err = capfd.readouterr().err
    assert err.startswith(option)
    assert len(err) <= MAX_MESSAGE


@pytest.mark.parametrize(
    "command", ["run bounce --plot", "tradeoff bounce --plot", "play bounce --record", "compare bounce --minimise"]
)
def test_pipe_or_device_is_not_replaced_by_a_file(command, folder, capfd):
    assert call([*command.split(), "pipe.png"]) == 2
    assert "not a file" in capfd.readouterr().err
    assert (folder / "pipe.png").is_fifo()
