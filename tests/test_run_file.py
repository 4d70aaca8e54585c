"""Run files: a valid stored run is read completely; a damaged one is refused with the array or key at fault."""

import dataclasses
import io
import json
import math
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox import run_file
from sandbox.action import Remove, Spawn
from sandbox.measure.run.runner import run, run_without_frames
from sandbox.resource_limits import TooLargeError
from sandbox.run_file import SHAPES, Info
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory

SCENE = loads("""
world = { gravity = [0.0, -10.0], duration = 0.5 }
plane = [{ point = [0.0, 0.0], normal = [0.0, 1.0] }]
ball = [
  { name = "a", position = [0.0, 1.0], radius = 0.5 },
  { name = "b", position = [3.0, 1.0], radius = 0.5 },
]
joint = [{ kind = "rod", between = ["a", "b"] }]
""")
"""Two balls on a rod, which fall on a plane."""

ACTIONS = (Spawn(time=0.1, ball=Ball(name="c", position=(9.0, 9.0), radius=1.0)), Remove(time=0.3, body="c"))

Members = dict[str, bytes]


@pytest.fixture(scope="module")
def stored_run() -> Trajectory:
    return run(SCENE, actions=ACTIONS, account=True)


@pytest.fixture
def path(stored_run: Trajectory, tmp_path: Path) -> Path:
    return stored_run.save(tmp_path / "run.npz")


def members_of(path: Path) -> Members:
    with zipfile.ZipFile(path) as archive:
        return {name.removesuffix(".npy"): archive.read(name) for name in archive.namelist()}


def write(path: Path, members: Members) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)


def array(values: object, pickled: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.asarray(values), allow_pickle=pickled)
    return stream.getvalue()


def header(shape: object, descr: str = "<f8") -> bytes:
    """Return a .npy file that ends after its header."""
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def refusal(path: Path) -> str:
    with pytest.raises(ValueError, match="is not a stored run") as caught:
        Trajectory.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path} is not a stored run: ")
    assert len(message) < 600
    return message.removeprefix(f"{path} is not a stored run: ")


def test_every_array_of_a_trajectory_has_a_declared_shape() -> None:
    assert {field.name for field in dataclasses.fields(Trajectory)} == set(SHAPES)


def test_info_model_has_the_keys_that_a_run_writes(stored_run: Trajectory) -> None:
    assert set(stored_run.info) | {"game"} == set(Info.model_fields)


def test_valid_run_is_read(path: Path, stored_run: Trajectory) -> None:
    found = Trajectory.load(path)
    assert found.info == stored_run.info
    assert found.account.tobytes() == stored_run.account.tobytes()
    assert found.names.tolist() == ["a", "b", "c"]
    assert found.position.flags.writeable


HUGE = 1_000_000_000_000_000
NO_ARRAY = "time is not an array of numbers or text"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("time", array([0.0, math.nan] + [0.5] * 49), "time: its times do not increase"),
        ("time", array([0.0, math.inf] + [0.5] * 49), "time: its times do not increase"),
        ("time", array(np.linspace(0.5, 0.0, 51)), "time: its times do not increase"),
        ("time", array(np.linspace(0.0, 1e8, 51)), "after the scene's duration"),
        ("time", array(np.linspace(0.0, 0.5, 52)), "position is 51 x 3 x 2 of float64, not 52 x 3 x 2 of float64"),
        ("time", array(0.5), "time is one value of float64, not T of float64"),
        ("time", array(np.zeros(51, np.float32)), "time is 51 of float32, not 51 of float64"),
        ("time", array(np.zeros(51, ">f8")), "time is of"),
        ("time", array(np.zeros(51, np.complex128)), "time is 51 of type c16"),
        ("time", array([{}] * 51, pickled=True), "time is of type |O, not float64"),
        ("time", array(np.zeros(51, [("x", "f8")])), NO_ARRAY),
        ("time", b"", "time is not an array"),
        ("time", b"\x93NUMPY\x01\x00", "unpack"),
        ("time", header(f"({HUGE},)"), "time is 1000000000000000 of float64, 8,000,000"),
        ("time", header("(-1,)"), NO_ARRAY),
        ("time", header("(" + "9" * 5000 + ",)"), NO_ARRAY),
        ("time", header("(" + "1, " * 20_000 + ")"), NO_ARRAY),
        ("time", header("(0,)", "<f8', 'descr': '<f8"), NO_ARRAY),
        ("names", header("(3,)", "<U999999999"), "names is 3 of text"),
        ("names", header(f"({HUGE},)", "<U0"), "not 51 x 1000000000000000 x 2 of float64"),
        ("names", array([1.0, 2.0, 3.0]), "names is 3 of float64, not 3 of text"),
        ("names", array(["b", "a", "c"]), "names: the bodies are not those"),
        ("names", array(["a", "b", ""]), "names: a name is invalid"),
        ("names", array(["a", "b", "\ud800"]), "names: a name is invalid"),
        ("names", array(np.array([97, 98, 2**31 - 1], "<u4").view("<U1")), "invalid characters"),
        ("contact_pair", array(np.zeros((0, 2))), "contact_pair is 0 x 2 of float64, not"),
        ("missed_time", array([math.nan]), "missed_pair is 0 x 2 of int64, not 1 x 2 of int64"),
        ("retired_time", array([math.nan, -1.0, math.nan]), "retired_time: a time is neither nan nor"),
        ("retired_time", array([math.nan, math.inf, math.nan]), "retired_time: a time is neither nan nor"),
        ("broken_time", array([math.nan, math.nan]), "broken_time has 2 joints, but info.scene 1"),
        ("broken_time", array([math.inf]), "broken_time: a time is neither nan nor"),
        ("energy", array(np.zeros(50)), "account is 51"),
        ("account", array(np.zeros((51, 2))), "account has 2 causes"),
        ("spin", array(np.zeros((51, 3))), "spin is 51 x 3 of float64, not 51 x 3 x 3"),
        ("layer", array(np.full((51, 3), 9)), "layer: a number is not one of the scene's 1 layers"),
        ("layer", array(np.zeros((51, 3))), "layer is 51 x 3 of float64, not 51 x 3 of integers"),
        ("info", array("{"), "info: Invalid JSON"),
        ("info", array("[]"), "info: "),
        ("info", array("\ud800"), "info"),
        ("info", array('{"a":' * 10_000 + "1" + "}" * 10_000), "info: Invalid JSON"),
        ("info", array(["{}"]), "info is 1 of text, not one value of text"),
        ("info", array(b"{}"), "info is one value of type S2, not one value of text"),
    ],
)
def test_damaged_array_is_refused(name: str, content: bytes, message: str, path: Path) -> None:
    write(path, members_of(path) | {name: content})
    assert message in refusal(path)


@pytest.mark.parametrize("value", [-3, 3, -(2**63)])
@pytest.mark.parametrize("column", [0, 1])
def test_contact_pair_with_an_unknown_index_is_refused(value, column, path, stored_run):
    pair = stored_run.contact_pair.copy()
    pair[-1, column] = value
    write(path, members_of(path) | {"contact_pair": array(pair)})
    assert "contact_pair: refers to an object that the scene does not have" in refusal(path)


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"scene": None}, "scene"), ({"scene": []}, "scene"), ({"scene": {"ball": "a"}}, "scene: ball"),
        ({"engine": None}, "engine"), ({"engine": ""}, "engine"), ({"engine": "a\nb"}, "engine"),
        ({"settings": []}, "settings"), ({"settings": {"dt": "0.1"}}, "settings.dt"),
        ({"settings": {"none": 1}}, "settings.none"), ({"actions": None}, "actions"),
        ({"actions": [{"kind": "jump"}]}, "actions.0"), ({"seed": -1}, "seed"), ({"seed": 1.5}, "seed"),
        ({"seed": 10**400}, "seed"), ({"versions": []}, "versions"), ({"versions": {"python": 3}}, "versions.python"),
        ({"status": "fine"}, "status"), ({"reason": 1}, "reason"), ({"steps": "50"}, "steps"),
        ({"steps": True}, "steps"), ({"seconds": None}, "seconds"), ({"seconds": math.nan}, "seconds"),
        ({"seconds": -1.0}, "seconds"), ({"work": {"pairs": math.inf}}, "work.pairs"),
        ({"work": {"x" * 10_000: "many"}}, "work.x"), ({"audited": 1}, "audited"),
        ({"energy_end": "much"}, "energy_end"), ({"game": []}, "game"), ({"game": {}}, "game.score"),
        ({"game": {"score": 10**400}}, "game.score"),
        ({"game": {"score": 1, "presses": [[math.nan, "left", 1]]}}, "game.presses.0.0"),
        ({"game": {"score": 1, "lamps": [[0.0, "left"]]}}, "game.lamps.0.1"),
    ],
)  # fmt: skip
def test_invalid_info_is_refused_at_its_path(changes, path, stored_run, tmp_path):
    file = stored_run.save(tmp_path / "run.npz")
    write(file, members_of(file) | {"info": array(json.dumps({**stored_run.info, **changes}))})
    assert refusal(file).startswith(f"info.{path}")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scene": {"title": "other"}}, "names has 3 bodies, but info.scene 0"),
        ({"actions": []}, "names has 3 bodies, but info.scene 2, and 0 were spawned"),
        ({"status": "refused"}, "time has 51 frames of a run of 50 steps that is refused"),
        ({"steps": 3}, "time has 51 frames of a run of 3 steps"),
        ({"energy_end": 10**400}, "info: an integer of 401 digits"),
        ({"causes": ["a"]}, "account has"),
    ],
)
def test_info_that_contradicts_the_arrays_is_refused(changes, message, path, stored_run):
    write(path, members_of(path) | {"info": array(json.dumps({**stored_run.info, **changes}))})
    assert message in refusal(path)


def test_info_without_a_required_key_is_refused_and_optional_keys_may_lack(path: Path, stored_run: Trajectory) -> None:
    members, needed = members_of(path), []
    for key in stored_run.info:
        write(path, members | {"info": array(json.dumps({k: v for k, v in stored_run.info.items() if k != key}))})
        if Info.model_fields[key].is_required():
            needed.append(key)
            assert refusal(path) == f"info.{key}: Field required"
        elif key not in ("actions", "causes"):  # the third body of this run and its account need them
            assert Trajectory.load(path).info == {k: v for k, v in stored_run.info.items() if k != key}
    assert {"scene", "engine", "settings", "seed", "status", "reason", "steps", "seconds"} <= set(needed)


@pytest.mark.parametrize("name", SHAPES)
def test_missing_array_is_named_unless_optional(name: str, path: Path) -> None:
    members = members_of(path)
    members.pop(name, None)
    write(path, members)
    if name not in run_file.OPTIONAL:
        assert refusal(path) == f"it has no {name}"
    elif name not in ("energy", "account"):  # each needs the other
        assert len(Trajectory.load(path).time) == 51


def swap(members: Members) -> Members:
    return members | {"position": members["angle"], "angle": members["position"]}


def rename(members: Members) -> Members:
    return {name.upper(): content for name, content in members.items()}


@pytest.mark.parametrize("change", [swap, rename])
def test_members_under_other_names_are_refused(change: Callable[[Members], Members], path: Path) -> None:
    write(path, change(members_of(path)))
    refusal(path)


@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_duplicate_member_is_refused(path: Path) -> None:
    time = members_of(path)["time"]
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("time.npy", time)
    assert refusal(path) == "it has time twice"


def test_archive_with_too_many_members_is_refused_before_it_is_opened(path, monkeypatch):
    with zipfile.ZipFile(path, "a") as archive:
        for number in range(2000):
            archive.writestr(f"{number}.npy", b"")
    monkeypatch.setattr(zipfile, "ZipFile", None)
    with pytest.raises(ValueError, match=r"run\.npz is not a stored run: the directory of the archive"):
        Trajectory.load(path)


def test_size_of_a_zip64_directory_is_limited_too(path: Path, stored_run: Trajectory) -> None:
    content = path.read_bytes()
    end = content[-22:]
    size, offset = struct.unpack("<2L", end[12:20])
    for stated in (size, 2**40):
        record = struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, 1, 1, stated, offset)
        locator = struct.pack("<4sLQL", b"PK\6\7", 0, len(content) - 22, 1)
        path.write_bytes(content[:-22] + record + locator + end)
        if stated == size:
            assert Trajectory.load(path).info == stored_run.info
        else:
            with pytest.raises(ValueError, match="the directory of the archive"):
                Trajectory.load(path)


@pytest.mark.parametrize(
    "content", [b"", b"title = 'x'", b"\x93NUMPY\x01\x00", b"PK\5\6" + bytes(17), b"PK\5\6" + bytes(17) + b"\1"]
)
def test_archive_without_an_end_record_is_refused(content: bytes, path: Path) -> None:
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"run\.npz is not a stored run: the end of the archive"):
        Trajectory.load(path)


def test_archive_with_another_compression_method_is_refused(path: Path) -> None:
    members = members_of(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    assert "compressed by another method" in refusal(path)


def test_array_in_fortran_order_is_read(path: Path, stored_run: Trajectory) -> None:
    write(path, members_of(path) | {"position": array(np.asfortranarray(stored_run.position))})
    assert np.array_equal(Trajectory.load(path).position, stored_run.position, equal_nan=True)


def test_arrays_that_do_not_fit_into_memory_are_not_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_file, "free_memory", lambda: 1000)
    with pytest.raises(TooLargeError, match=r"run\.npz: its arrays take .* GB, but .* can be used"):
        Trajectory.load(path)


def test_zip_bomb_is_refused_before_it_is_expanded(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    contacts = 400_000
    pairs = np.zeros((contacts, 2))
    names = ("contact_point", "contact_normal", "contact_impulse")
    bomb = dict.fromkeys(names, array(pairs)) | {"contact_pair": array(pairs.astype(np.int64))}
    write(path, members_of(path) | bomb | {"contact_time": array(pairs[:, 0])})
    monkeypatch.setattr(run_file, "free_memory", lambda: 2**24)
    assert path.stat().st_size < 2**18
    with pytest.raises(TooLargeError, match="can be used"):
        Trajectory.load(path)


def test_more_contacts_than_a_run_records_are_not_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_CONTACTS", "0")
    with pytest.raises(TooLargeError, match=r"run\.npz: its contacts are .* SANDBOX_MAX_CONTACTS="):
        Trajectory.load(path)


def test_info_beyond_the_size_of_a_session_is_not_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_SESSION_SIZE", "500")
    with pytest.raises(TooLargeError, match=r"run\.npz: its info .* SANDBOX_MAX_SESSION_SIZE="):
        Trajectory.load(path)


def test_message_is_one_printable_line(path: Path, stored_run: Trajectory) -> None:
    write(path, members_of(path) | {"info": array(json.dumps({**stored_run.info, "work": {"\x1b[31m\n": "x"}}))})
    assert refusal(path).isprintable()


def test_run_whose_process_was_killed_is_stored_without_frames(tmp_path: Path) -> None:
    killed = run_without_frames(SCENE, "pymunk", SCENE.solver, (), "failed", "its process was killed")
    assert not len(Trajectory.load(killed.save(tmp_path / "run.npz")).time)


def test_folder_raises_is_a_directory_error(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        Trajectory.load(tmp_path)


def _first_frames(arrays: dict[str, Any]) -> None:
    per_frame = [name for name, shape in SHAPES.items() if shape[:1] in (("T",), ("E",)) and name in arrays]
    for name in per_frame:
        arrays[name] = arrays[name][:5]


def _with_nan(arrays: dict[str, Any]) -> None:
    arrays["velocity"][7, 1, 0] = np.nan


def _with_other_position(arrays: dict[str, Any]) -> None:
    arrays["position"][-1, 0, 0] += 1e-9


def _all_at_time_0(arrays: dict[str, Any]) -> None:
    arrays["time"][:] = 0.0


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_first_frames, "the last state is not the one whose hash is in info"),
        (_with_nan, "velocity: has values that are not finite"),
        (_with_other_position, "the last state is not the one whose hash is in info"),
        (_all_at_time_0, "time: two frames of a complete run have the same time"),
    ],
)
def test_complete_run_with_other_values_is_refused(damage, message, tmp_path):
    path = run(SCENE).save(tmp_path / "run.npz")
    assert Trajectory.load(path).status == "ok"
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    damage(arrays)
    np.savez_compressed(path, **arrays)
    assert message in refusal(path)


def test_run_whose_steps_miss_the_duration_by_rounding_is_loaded(tmp_path: Path) -> None:
    text = "[world]\nduration = 0.4166666666666667\n[solver]\ndt = 0.016666666666666684\n"
    found = run(loads(text + "[[ball]]\nposition = [0, 0]\nradius = 1\nvelocity = [1, 0]\n"), "pymunk")
    assert found.time[-1] != 25 * found.info["settings"]["dt"]  # by 4e-16 s
    assert Trajectory.load(found.save(tmp_path / "run.npz")).time[-1] == found.time[-1]


@pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference", "exact"])
def test_run_whose_duration_is_no_whole_number_of_steps_is_read_back(engine: str, tmp_path: Path) -> None:
    """Engines that make whole steps only end up to a step after the duration."""
    scene = loads("[world]\nduration = 0.0155\n[solver]\ndt = 0.001\n[[ball]]\nposition = [0, 0]\nradius = 0.3\n")
    found = run(scene, engine)
    assert found.time[-1] == pytest.approx(0.016 if engine in ("pymunk", "box2d") else 0.0155, rel=1e-12)
    loaded = Trajectory.load(found.save(tmp_path / "run.npz"))
    assert loaded.time.tolist() == found.time.tolist()
