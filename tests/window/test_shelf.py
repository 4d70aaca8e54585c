"""Neighbouring scenes, scenes of the picker, messages, and facts of a body."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.trajectory import Contacts, Frame
from sandbox.window import app_state as module
from sandbox.window.app_state import MAX_MESSAGES, Messages, neighbouring_scene, scenes_beside, scenes_to_pick
from sandbox.window.ui.status import body_facts, settings_text


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.toml", "a.toml", "c.toml", "notes.txt"):
        (tmp_path / name).write_text('title = "t"\n')
    return tmp_path


def test_neighbouring_scene_accepts_relative_paths_and_links(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    found = neighbouring_scene(Path("a.toml"), 1)
    assert found is not None
    assert found.resolve() == (folder / "b.toml").resolve()
    (folder / "link.toml").symlink_to(folder / "a.toml")
    assert neighbouring_scene(folder / "link.toml", 1) is not None


def test_neighbouring_scene_starts_from_other_and_missing_files(folder: Path) -> None:
    for current in (folder / "notes.txt", folder / "gone.toml"):
        assert scenes_beside(current)[0] == current
        assert neighbouring_scene(current, 1) == folder / "a.toml"
        assert neighbouring_scene(current, -1) == folder / "c.toml"
    lonely = folder / "no such folder" / "x.toml"
    assert neighbouring_scene(lonely, 1) == lonely


def test_neighbouring_scenes_without_a_file_are_the_shipped_scenes() -> None:
    files = [each.path for each in shipped()]
    assert list(scenes_beside(None)) == files
    assert neighbouring_scene(None, 1) == files[0]
    assert neighbouring_scene(None, -1) == files[-1]


def test_picker_offers_neighbouring_and_shipped_scenes_without_duplicates(folder: Path) -> None:
    offered = scenes_to_pick(folder / "a.toml")
    assert [name for name, _ in offered[:3]] == [f"{folder.name}/{stem}" for stem in "abc"]
    assert offered[3:] == scenes_to_pick(None) == [(each.name, each.path) for each in shipped()]
    assert scenes_to_pick(shipped()[0].path) == scenes_to_pick(None)


def test_messages_expire_and_repeated_messages_are_merged(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(module, "perf_counter", lambda: now[0])
    messages = Messages()
    messages.add("one")
    messages.add("two", "error")
    now[0] += 2.0
    messages.add("one")
    assert messages.visible() == (("error", "two"), ("info", "one"))
    now[0] += 2.9
    assert messages.visible() == (("error", "two"), ("info", "one"))
    now[0] += 0.2
    assert messages.visible() == (("error", "two"),)
    now[0] += 6.0
    assert messages.visible() == ()
    for k in range(9):
        messages.add(str(k))
    assert [text for _, text in messages.visible()] == ["4", "5", "6", "7", "8"][-MAX_MESSAGES:]


def test_body_facts_list_speed_energy_and_contacts() -> None:
    scene = from_document(
        {
            "ball": [
                {"name": "cue", "position": [1, 2], "velocity": [3, 4], "radius": 0.5, "mass": 2, "angle": 0.25},
                {"name": "post", "position": [9, 2], "radius": 0.5, "fixed": True},
            ]
        }
    )
    bodies = scene.bodies
    state = (bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity)
    frame = Frame(0.0, *(array.copy() for array in state), np.ones(2, np.bool_))
    pair = np.asarray([[0, -1], [0, 1], [1, -1]])
    contacts = Contacts(np.zeros(3), pair, *(np.zeros((3, 2)) for _ in range(3)))
    lines = body_facts(bodies, frame, contacts, 0)
    assert lines[0] == "cue"
    assert any(line.startswith("|v| 5") for line in lines)
    assert any(line.startswith("E kin 25") for line in lines)
    assert lines[-1] == "2 contacts"
    assert "fixed" in body_facts(bodies, frame, Contacts.none(), 1)
    absent = Frame(0.0, *(array.copy() for array in state), np.zeros(2, np.bool_))
    assert body_facts(bodies, absent, contacts, 0) == ("cue", "removed")
    assert body_facts(bodies, frame, contacts, 2) == ()


def test_settings_text_lists_only_relevant_settings() -> None:
    assert settings_text(Settings(dt=0.01)) == "dt 10.0 ms"
    words = settings_text(Settings(dt=0.01, substeps=2, integrator="rk4", detection="swept", response="penalty"))
    assert words == "dt 10.0 ms · 2 × 10 iterations · rk4 · swept · penalty"
    assert (
        settings_text(Settings(integrator="rk4", detection="discrete", response="impulse"))
        == "dt 10.0 ms · 1 × 10 iterations · rk4"
    )
