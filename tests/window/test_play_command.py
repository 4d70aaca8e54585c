"""Commands `play` and `replay`: invalid input is a one-line error, and a stored run is no session to save."""

from pathlib import Path

import pytest

import sandbox
from sandbox.cli.main import call
from sandbox.window.app import App

REST = 'title = "Rest"\n[[ball]]\nname = "a"\nposition = [0.0, 0.0]\nradius = 0.4\n'
FAULTY = '[[ball]]\nname = "a"\nposition = [0.0]\nradius = 1.0\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in (("room.toml", REST), ("faulty.toml", FAULTY)):
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("play none-such", "none-such: "),
        ("play room.toml --engine none-such", "--engine: "),
        ("play room.toml --set ball.a.radius=-1", "room.toml: ball.a.radius (set): "),
        ("play --set world.seed=2", "--set: "),
        ("play room.toml --size none", "sandbox play: "),
        ("play room.toml --record no/where.json", "--record: "),
        ("play faulty.toml", "faulty.toml:3: ball.a.position"),
        ("replay none-such", "none-such: "),
        ("replay room.toml", "room.toml: "),
        ("replay .", ".: "),
    ],
)
def test_invalid_input_is_a_one_line_error(arguments: str, line: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(arguments.split()) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert err.startswith(line)


def test_stored_run_is_not_saved_as_a_session(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    sandbox.run(sandbox.load("room.toml")).save("run.npz")
    monkeypatch.setattr(App, "run", lambda _: 0)  # the window is closed at once
    assert call(["replay", "run.npz", "--record", "all.json"]) == 1
    assert capfd.readouterr().err == "--record: all.json: there is no session to save\n"
