"""Drafts: changes in place, undo to the byte, refused faults, and saving."""

import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.description.base import Point
from sandbox.scene.description.joints import Pivot
from sandbox.scene.editing.clipboard import copy_elements, paste_elements
from sandbox.scene.editing.draft import NEW_SCENE, SceneDraft
from sandbox.scene.editing.elements import ElementKey, all_elements, material_users, removal_changes, renaming_changes
from sandbox.scene.editing.transforms import Similarity, transform_elements
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.scene.files.toml_changes import AddElement, Change, SetValue

TEXT = """# a car, by hand
title = "Car"   # shown in the window
world = { gravity = [0.0, -9.81] }

[[plane]]
name = "road"
point = [0, 0]
normal = [0.0, 1.0]

# the wheels
[[ball]]
name = "rear"
position = [-1.0, 0.4]  # m
radius = 4e-1

[[box]]
name = "chassis"
position = [0.0, 0.8]
size = [2.4, 0.4]

[[ball]]
name = "front"
position = [1.0, 0.4]
radius = 0.4

[[joint]]
kind = "pivot"
between = ["chassis", "rear"]
at = [-1.0, 0.4]

[[joint]]
kind = "spring"
between = ["chassis", "front"]
anchors = [[1.0, 0.0], [0.0, 0.0]]
stiffness = 2e3
"""


@pytest.fixture
def draft(tmp_path: Path) -> SceneDraft:
    path = tmp_path / "car.toml"
    path.write_text(TEXT)
    return SceneDraft.read(path)


def move(draft: SceneDraft, *keys: ElementKey, by: tuple[float, float] = (1.0, 0.5)) -> None:
    values = transform_elements(draft.scene, keys, Similarity(shift=by))
    draft.change([SetValue((*k.location, name), v) for k, each in values.items() for name, v in each.items()], "move")


def test_change_keeps_everything_else_to_the_byte(draft: SceneDraft) -> None:
    move(draft, ElementKey("ball", 0))
    before, after = TEXT.splitlines(), draft.text.splitlines()
    changed = [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert [after[k] for k in changed] == ["position = [0.0, 0.9]  # m"]
    assert draft.scene.balls[0].position == (0.0, 0.9)


def test_undo_and_redo_restore_texts_to_the_byte(draft: SceneDraft) -> None:
    texts = [draft.text]
    move(draft, ElementKey("ball", 0))
    texts.append(draft.text)
    draft.change(removal_changes(draft.scene, [ElementKey("box", 0)]), "delete a box")
    texts.append(draft.text)
    assert (draft.undo_label, draft.redo_label) == ("delete a box", None)
    assert [draft.undo(), draft.text, draft.undo(), draft.text] == ["delete a box", texts[1], "move", texts[0]]
    assert draft.undo() is None
    assert not draft.is_changed
    assert [draft.redo(), draft.text, draft.redo(), draft.text] == ["move", texts[1], "delete a box", texts[2]]
    assert draft.redo() is None
    draft.undo()
    move(draft, ElementKey("ball", 1))
    assert draft.redo() is None  # another change has replaced the undone one


def test_changes_with_one_mark_are_undone_together(draft: SceneDraft) -> None:
    for k in range(5):
        draft.change([SetValue(("ball", 0, "position"), [0.1 * k, 0.4])], "nudge", "arrows")
    draft.change([SetValue(("ball", 0, "radius"), 0.5)], "set radius")
    draft.undo()
    draft.undo()
    assert draft.text == TEXT


def test_change_that_gives_a_fault_is_refused(draft: SceneDraft) -> None:
    for change in (
        SetValue(("ball", 0, "radius"), -1.0),
        SetValue(("ball", 0, "name"), "front"),
        SetValue(("ball", 0, "position"), [0.0, -2000.0]),
        SetValue(("ball", 0, "material"), "cheese"),
        SetValue(("ball", 0, "weight"), 1.0),
    ):
        with pytest.raises(SceneError) as caught:
            draft.change([change], "spoil")
        assert caught.value.faults[0].path.startswith("ball")
        assert (draft.text, draft.undo_label) == (TEXT, None)


def test_removal_takes_what_is_attached(draft: SceneDraft) -> None:
    draft.change(removal_changes(draft.scene, [ElementKey("ball", 0)]), "delete")
    assert [joint.kind for joint in draft.scene.joints] == ["spring"]
    assert "# the wheels" not in draft.text
    assert "# a car, by hand" in draft.text
    draft.change(removal_changes(draft.scene, [ElementKey("box", 0)]), "delete")
    assert draft.scene.joints == ()


def pivot_of(draft: SceneDraft, joint: int) -> Point | None:
    pivot = draft.scene.joints[joint]
    assert isinstance(pivot, Pivot)
    return pivot.at


def test_renaming_follows_references(draft: SceneDraft) -> None:
    draft.change(renaming_changes(draft.scene, ElementKey("box", 0), 'body "one"'), "rename")
    assert [joint.between[0] for joint in draft.scene.joints] == ['body "one"'] * 2


EVENTS = """
[[ball]]
name = "car"
position = [0, 0]
radius = 1
[[ball]]
name = "disc"
position = [9, 0]
radius = 1
[[tyre]]
name = "rear"
body = "car"
grip = 2.0
[[joint]]
name = "rear"
kind = "motor"
between = ["disc"]
rate = 1.0
[[joint]]
name = "front"
kind = "motor"
between = ["car"]
rate = 1.0
[[event]]
time = 0.1
kind = "steer"
tyre = "rear"
throttle = 1.0
[[event]]
time = 0.2
kind = "actuate"
levels = { rear = 0.5, front = 0.25 }
[[event]]
time = 0.3
kind = "unjoin"
joint = "front"
"""


def test_removal_takes_the_events_of_tyres_and_joints() -> None:
    draft = SceneDraft(EVENTS)
    draft.change(removal_changes(draft.scene, [ElementKey("ball", 0)]), "delete")
    assert [event.kind for event in draft.scene.events] == ["actuate"]
    assert getattr(draft.scene.events[0], "levels", None) == {"rear": 0.5}
    draft.change(removal_changes(draft.scene, [ElementKey("joint", 0)]), "delete")
    assert not draft.scene.events


def test_renaming_a_tyre_or_a_joint_follows_the_events() -> None:
    draft = SceneDraft(EVENTS)
    draft.change(renaming_changes(draft.scene, ElementKey("tyre", 0), "driven"), "rename")
    draft.change(renaming_changes(draft.scene, ElementKey("joint", 1), "engine 1"), "rename")
    assert draft.text == EVENTS.replace('name = "rear"\nbody', 'name = "driven"\nbody').replace(
        'tyre = "rear"', 'tyre = "driven"'
    ).replace('"front"', '"engine 1"').replace("front = 0.25", '"engine 1" = 0.25')


def test_material_of_a_part_is_renamed_with_it() -> None:
    draft = SceneDraft(
        '[[material]]\nname = "a"\n[[body]]\nposition = [0, 0]\nball = [{ radius = 1, material = "a" }]\n'
    )
    assert material_users(draft.scene, "a") == [ElementKey("body", 0)]
    draft.change(renaming_changes(draft.scene, ElementKey("material", 0), "b"), "rename")
    assert draft.text.count('"b"') == 2 and draft.scene.compounds[0].balls[0].material == "b"


def test_copies_have_names_and_joints_of_their_own(draft: SceneDraft) -> None:
    scene = draft.scene
    keys = [key for key, _ in all_elements(scene) if key.table in ("ball", "box")]
    changes, added = paste_elements(scene, copy_elements(scene, keys), Similarity(shift=(10.0, 0.0)))
    draft.change(changes, "paste")
    assert [ball.name for ball in draft.scene.balls] == ["rear", "front", "rear 2", "front 2"]
    assert [joint.between for joint in draft.scene.joints[2:]] == [("chassis 2", "rear 2"), ("chassis 2", "front 2")]
    assert pivot_of(draft, 2) == (9.0, 0.4)
    assert ElementKey("joint", 3) in added
    again, _ = paste_elements(draft.scene, copy_elements(draft.scene, keys), Similarity(shift=(20.0, 0.0)))
    draft.change(again, "paste")
    assert draft.scene.balls[-1].name == "front 3"


def test_pivot_moves_with_its_bodies_only_if_all_move(draft: SceneDraft) -> None:
    move(draft, ElementKey("ball", 0))
    assert pivot_of(draft, 0) == (-1.0, 0.4)
    draft.undo()
    move(draft, ElementKey("ball", 0), ElementKey("box", 0))
    assert pivot_of(draft, 0) == (0.0, 0.9)


def test_saved_file_is_the_text(draft: SceneDraft, tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.chmod(0o640)
    move(draft, ElementKey("ball", 1))
    assert draft.is_changed
    assert draft.save() == path
    assert path.read_text() == draft.text
    assert load(path) == draft.scene
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert not draft.is_changed
    draft.undo()
    assert draft.is_changed
    other = draft.save(tmp_path / "other.toml")
    assert (draft.path, other.read_text()) == (other, TEXT)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["car.toml", "other.toml"]


def test_change_of_the_file_on_disk_is_noticed(draft: SceneDraft, tmp_path: Path) -> None:
    assert not draft.is_file_changed()
    (tmp_path / "car.toml").write_text(TEXT + "# more\n")
    assert draft.is_file_changed()
    (tmp_path / "car.toml").unlink()
    assert draft.is_file_changed()


def test_folder_that_cannot_be_written_is_a_fault(draft: SceneDraft, tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    for name, message in (
        ("no/such/folder.toml", "there is no folder"),
        ("scene.json", "ends in .toml"),
        ("folder.toml", "is a folder"),
    ):
        with pytest.raises(SceneError, match=message):
            draft.save(tmp_path / name)
    assert (tmp_path / "car.toml").read_text() == TEXT


def test_full_disk_keeps_the_old_file(draft: SceneDraft, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def full(self: Path, _data: bytes) -> int:
        raise OSError(28, "No space left on device", str(self))

    move(draft, ElementKey("ball", 0))
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(SceneError, match="No space left on device"):
        draft.save()
    assert (tmp_path / "car.toml").read_text() == TEXT
    assert draft.is_changed
    assert [each.name for each in tmp_path.iterdir()] == ["car.toml"]


def test_new_scene_has_a_ground_and_no_file() -> None:
    draft = SceneDraft()
    assert (draft.text, draft.path, draft.is_changed) == (NEW_SCENE, None, False)
    assert [plane.name for plane in draft.scene.planes] == ["ground"]
    with pytest.raises(SceneError, match="give it a name"):
        draft.save()


def test_faulty_file_is_not_edited(tmp_path: Path) -> None:
    path = tmp_path / "faulty.toml"
    for content in (b"[[ball]]\nradius = 1\n", b"\xff", b"", b"x = "):
        path.write_bytes(content)
        with pytest.raises(SceneError):
            SceneDraft.read(path)
    with pytest.raises(SceneError, match="No such file"):
        SceneDraft.read(tmp_path / "missing.toml")


def test_preset_is_taken_apart_into_elements() -> None:
    draft = SceneDraft.read(find("9-ball"))
    assert draft.preset is not None
    before = draft.scene
    draft.take_apart_preset()
    assert draft.preset is None
    assert len(draft.scene.bodies) == len(before.bodies)
    draft.undo()
    assert draft.preset is not None


OPERATIONS = st.tuples(
    st.sampled_from(["move", "rotate", "scale", "mirror", "delete", "copy", "add", "rename", "undo", "redo"]),
    st.integers(0, 20),
    st.floats(-3.0, 3.0).map(lambda x: round(x, 3)),
)


def apply(draft: SceneDraft, operation: tuple[str, int, float]) -> None:
    """Apply a random operation of the editor; one that would give faults is refused."""
    kind, number, amount = operation
    keys = [key for key, _ in all_elements(draft.scene) if key.table not in ("material", "pair")]
    if kind in ("undo", "redo"):
        getattr(draft, kind)()
        return
    if not keys:
        return
    key = keys[number % len(keys)]
    changes: list[Change] = []
    by = {
        "move": Similarity(shift=(amount, 0.5 * amount)),
        "rotate": Similarity((0.5, 0.5), angle=amount),
        "scale": Similarity((0.0, 1.0), scale=abs(amount) + 0.1),
        "mirror": Similarity((amount, 0.0), mirrored=True),
    }.get(kind)
    if by is not None:
        values = transform_elements(draft.scene, [key], by)
        changes = [SetValue((*k.location, name), plain(v)) for k, each in values.items() for name, v in each.items()]
    elif kind == "delete":
        changes = removal_changes(draft.scene, [key])
    elif kind == "copy":
        changes, _ = paste_elements(draft.scene, copy_elements(draft.scene, [key]), Similarity(shift=(amount, 1.0)))
    elif kind == "add":
        changes = [AddElement("ball", {"name": f"new {number} {amount}", "position": [amount, 9.0], "radius": 0.1})]
    elif kind == "rename":
        changes = renaming_changes(draft.scene, key, f"name {number} {amount}") if hasattr_name(draft, key) else []
    with suppress(SceneError):  # such as two elements of one name
        draft.change(changes, kind)


def hasattr_name(draft: SceneDraft, key: ElementKey) -> bool:
    return any(each == key and hasattr(element, "name") for each, element in all_elements(draft.scene))


def plain(value: Any) -> Any:
    return [plain(each) for each in value] if isinstance(value, tuple | list) else value


@pytest.mark.fail_slow(60)  # takes over half a second
@given(st.lists(OPERATIONS, max_size=12))
def test_undoing_everything_restores_the_start(operations: list[tuple[str, int, float]]) -> None:
    draft = SceneDraft(TEXT)
    for operation in operations:
        apply(draft, operation)
        assert loads(draft.text) == draft.scene
    while draft.redo() is not None:
        pass
    end, count = draft.text, 0
    while draft.undo() is not None:
        count += 1
    assert draft.text == TEXT
    assert [draft.redo() is not None for _ in range(count)] == [True] * count
    assert (draft.text, draft.redo()) == (end, None)
