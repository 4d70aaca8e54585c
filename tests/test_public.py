"""The public interface: names of `import sandbox`, their behaviour, and the cost of the import."""

import ast
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import get_args

import pytest

import sandbox
from sandbox.action import Action

KINDS = sorted(kind.__name__ for kind in get_args(get_args(Action)[0]))
"""Kinds of actions."""

TEXT = '[world]\nduration = 0.1\n[[ball]]\nname = "a"\nposition = [0, 0]\nvelocity = [1, 0]\nradius = 1\n'


def test_public_names_are_sorted_and_listed_by_dir() -> None:
    assert sandbox.__all__ == sorted(sandbox.__all__, key=lambda name: (not name.isupper(), name))
    assert dir(sandbox) == sorted(sandbox.__all__)


def test_type_checkers_see_the_public_names() -> None:
    tree = ast.parse(Path(sandbox.__file__).read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    seen = {(alias.asname, each.module) for each in imports for alias in each.names if alias.asname == alias.name}
    assert seen == set(sandbox._HOMES.items())


@pytest.mark.parametrize("name", sandbox.__all__)
def test_name_is_importable_and_documented(name: str) -> None:
    value = getattr(sandbox, name)
    assert value is getattr(sandbox, name)
    if not name.isupper():
        assert value.__name__ == name
        assert value.__doc__


def test_signatures_of_models_list_their_fields() -> None:
    names = [*KINDS, "Ball", "Settings", "Stroke"]
    code = f"import inspect, sandbox\nfor n in {names}: print(*inspect.signature(getattr(sandbox, n)).parameters)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    fields = [[field.alias or key for key, field in getattr(sandbox, n).model_fields.items()] for n in names]
    assert [line.split() for line in done.stdout.splitlines()] == fields


def test_every_kind_of_action_is_public() -> None:
    assert len(KINDS) > 10
    assert set(KINDS) <= set(sandbox.__all__)


def test_version_is_that_of_the_package() -> None:
    assert sandbox.__version__ == version("sandbox2d")


def test_run_applies_actions_and_fails_at_an_impossible_one() -> None:
    scene = sandbox.loads(TEXT)
    kick = sandbox.Impulse(time=0.0, body="a", impulse=(1.0, 0.0))
    ball = sandbox.Ball(name="b", position=(5.0, 0.0), radius=1.0)
    completed = sandbox.run(scene, actions=[kick, sandbox.Spawn(time=0.05, ball=ball)])
    assert (completed.status, completed.names.tolist()) == ("ok", ["a", "b"])
    assert completed.velocity[-1, 0].tolist() == [2.0, 0.0]  # 1 m/s, and 1 N·s on 1 kg
    failed = sandbox.run(scene, actions=[sandbox.Remove(time=0.0, body="nobody")])
    assert failed.status == "failed"
    assert "no body is named 'nobody'" in str(failed.reason)


def test_shipped_scene_is_loaded_by_name_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert sandbox.load("bounce") == sandbox.load("tutorial/bounce")
    with pytest.raises(sandbox.SceneError, match="did you mean tutorial/bounce"):
        sandbox.load("bounc")


def test_star_import_brings_all_public_names() -> None:
    namespace: dict[str, object] = {}
    exec("from sandbox import *", namespace)
    assert set(sandbox.__all__) <= set(namespace)


def test_unknown_name_raises_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"^module 'sandbox' has no attribute 'nonsense'$"):
        sandbox.nonsense  # noqa: B018, the point of the test
    assert not hasattr(sandbox, "__path_to_nowhere__")


def test_scene_is_loaded_run_saved_and_loaded_again(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT)
    scene = sandbox.load(path)
    assert scene == sandbox.loads(TEXT) == sandbox.loads(sandbox.dumps(scene))
    run = sandbox.run(scene, engine="pymunk", dt=0.05)
    assert (run.status, run.time.tolist(), run.missed_contacts) == ("ok", [0.0, 0.05, 0.1], 0)
    assert run.position[-1, run.number("a"), 0] == pytest.approx(0.1, rel=1e-15)  # two roundings
    read = sandbox.Trajectory.load(run.save(tmp_path / "run.npz"))
    assert (read.position == run.position).all()


def test_simulation_is_stepped_by_hand() -> None:
    simulation = sandbox.start(sandbox.loads(TEXT), "pymunk")
    assert simulation.time == 0.0
    simulation.step()
    frame = simulation.frame()
    assert isinstance(frame, sandbox.Frame)
    assert (frame.time, frame.position.tolist(), frame.velocity.tolist()) == (0.01, [[0.01, 0.0]], [[1.0, 0.0]])
    assert (frame.angle.tolist(), frame.angular_velocity.tolist()) == ([0.0], [0.0])
    assert len(simulation.contacts()) == 0
    simulation.close()


def test_scene_error_carries_its_faults() -> None:
    with pytest.raises(sandbox.SceneError) as caught:
        sandbox.loads("[[ball]]\nradius = -1\nposition = [0, 0]\n", "x.toml")
    (fault,) = caught.value.faults
    assert isinstance(fault, sandbox.Fault)
    assert (fault.file, fault.line, fault.path) == ("x.toml", 2, "ball[0].radius")


def test_import_loads_nothing_heavy() -> None:
    code = "import sys, sandbox; print([n for n in ('numpy', 'pydantic', 'pymunk', 'click') if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.fail_slow(60)  # takes over half a second
def test_run_works_without_assertions() -> None:
    code = f"import sandbox; print(sandbox.run(sandbox.loads({TEXT!r})).status)"
    done = subprocess.run([sys.executable, "-O", "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == "ok\n"


def test_scene_is_run_by_its_name_or_path(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT)
    assert sandbox.run(path).status == sandbox.run(str(path)).status == "ok"
    simulation = sandbox.start("bounce")
    assert repr(simulation) == f"<Simulation of {sandbox.load('bounce').title!r} on pymunk at 0 s, 1 body>"
    simulation.close()
    with pytest.raises(sandbox.SceneError, match="did you mean tutorial/bounce"):
        sandbox.run("bounc")
    assert [row.engine for row in sandbox.compare(path, "pymunk").rows] == ["pymunk"]
    found = sandbox.tradeoff(path, "pymunk", most=1, repeats=1)
    assert {point.engine for point in found.points} == {"pymunk"}


@pytest.mark.parametrize(
    ("name", "hint"), [("Dt", "did you mean 'dt'"), ("seed", r"load\(…, \['world.seed=2'\]\)"), ("zzz", "known: dt, ")]
)
def test_unknown_setting_is_refused_with_a_hint(name: str, hint: str) -> None:
    scene = sandbox.loads(TEXT)
    for call in (sandbox.run, sandbox.compare, sandbox.tradeoff):
        with pytest.raises(ValueError, match=hint):
            call(scene, **{name: 0.1})
