"""Kernels: the same answers with and without numba, in processes of their own, and what is said about compiling."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from functools import cache
from pathlib import Path

import pytest

from tests.engines.reference.pieces import ROOT

pytestmark = pytest.mark.full  # child processes and pages

HERE = Path(__file__).resolve().parent

ANNOUNCEMENT = "compiling some functions for the first time; later runs start at once"

HASHES = """
import json
from tests.engines.reference.pieces import EARTH, FLOOR, ball, running, scene_of, shipped, small_pile, stepped

def court(**more):
    balls = [ball(-2 + 1.1 * k, 2 + 0.3 * k, velocity=[9 - 5 * k, -6], name=f"b{k}", friction=0.3) for k in range(4)]
    return scene_of(
        *balls, world={**EARTH, "linear_drag": 0.1, "quadratic_drag": 0.05}, plane=[FLOOR], solver={"dt": 0.02},
        wall=[{"points": [[3, 0], [3, 4], [-4, 5], [-4, 0]], "restitution": 0.7, "friction": 0.2}],
        post=[{"position": [0.5, 1.2], "radius": 0.3, "restitution": 0.9}],
    )

runs = {
    "bounce": stepped(running(shipped("tutorial/bounce")), 1500),
    "pile": stepped(running(small_pile(60)), 40),
    "pile, sweep": stepped(running(small_pile(24), broad_phase="sweep"), 40),
    "pile, circles": stepped(running(small_pile(24), broad_phase="circles"), 40),
    "gas": stepped(running(shipped("benchmark/gas"), dt=0.02, substeps=1), 40),
    "penalty": stepped(running(small_pile(12), response="penalty", substeps=10), 20),
    "bisect": stepped(running(court(), detection="bisect", integrator="velocity_verlet"), 60),
    "swept": stepped(running(court(), detection="swept", integrator="rk4"), 60),
    "shrink": stepped(running(court(), detection="shrink", integrator="leapfrog"), 30),
}
assert all(run.work["contacts"] for run in runs.values())
print(json.dumps({name: run.state_hash() for name, run in runs.items()}))
"""

TINY = """
from sandbox.engines.reference.manifold import circle_circle
print(circle_circle(0.0, 0.0, 1.0, 3.0, 4.0, 1.0))
"""


def python(code, root=ROOT, **environment):
    """Run code in a process of its own; return what it wrote, on standard output and on standard error."""
    paths = os.pathsep.join((str(root), str(HERE)))
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env={**os.environ, "PYTHONPATH": paths, **environment},
        cwd=root,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


@cache
def hashes(disabled):
    return json.loads(python(HASHES, NUMBA_DISABLE_JIT=disabled)[0])


@pytest.mark.slow  # the court, the pile and the gas take some seconds uncompiled
def test_answers_are_the_same_bit_for_bit_compiled_or_not():
    assert hashes("0") == hashes("1")


def installed(folder):
    """Return a copy of the package, whose sources no cache knows."""
    shutil.copytree(ROOT / "sandbox", folder / "sandbox", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_compiling_is_announced_once_and_found_on_disk_after(tmp_path):
    root = installed(tmp_path)
    first, second = (python(TINY, root, NUMBA_DISABLE_JIT="0") for _ in range(2))
    assert first[0] == second[0] == "(3.0, 0.6000000000000001, 0.8)\n"
    assert first[1] == ANNOUNCEMENT + "\n"
    assert second[1] == ""


@pytest.mark.parametrize(("age", "left"), [(60, 2), (7200, 1)])
def test_changed_sources_are_compiled_anew_and_what_is_old_is_removed(tmp_path, age, left):
    root = installed(tmp_path)
    python(TINY, root, NUMBA_DISABLE_JIT="0")
    cache_home = root / "sandbox" / "engines" / "__pycache__"
    (before,) = cache_home.glob("kernels-*")
    then = before.stat().st_mtime - age
    os.utime(before, (then, then))
    # A callee in another file: what numba's own cache would not notice.
    source = root / "sandbox" / "engines" / "reference" / "broad_phase.py"
    source.write_text(source.read_text() + "\n# changed\n")
    assert python(TINY, root, NUMBA_DISABLE_JIT="0")[1] == ANNOUNCEMENT + "\n"
    assert len(list(cache_home.glob("kernels-*"))) == left
    assert before.exists() == (left == 2)  # while it is young, another process may be compiling into it


def test_where_the_install_cannot_be_written_the_users_cache_serves(tmp_path):
    root = installed(tmp_path / "site")
    # A file in the place of the folder: no user, not even root, can write into it.
    (root / "sandbox" / "engines" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    home.mkdir()
    environment = {"XDG_CACHE_HOME": str(home), "NUMBA_DISABLE_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    first, second = (python(TINY, root, **environment) for _ in range(2))
    assert first[1] == ANNOUNCEMENT + "\n"
    assert second == (first[0], "")
    assert len(list((home / "sandbox2d").glob("kernels-*"))) == 1


def test_full_disk_is_one_line_and_kernels_are_compiled_again(tmp_path):
    root = installed(tmp_path)
    limit = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))\n"
    two = "from sandbox.engines.reference.broad_phase import cell_of\nprint(cell_of(0.5, 2.0))\n"
    for _ in range(2):
        said, complaints = python(limit + textwrap.dedent(TINY) + two, root, NUMBA_DISABLE_JIT="0")
        assert said.startswith("(3.0, 0.6000000000000001, 0.8)\n")
        announced, warning = complaints.splitlines()
        assert (announced, "File too large" in warning) == (ANNOUNCEMENT, True)
    left = (file for file in tmp_path.rglob("kernels-*/**/*") if file.is_file())
    assert [file.name for file in left] == []


def test_where_nothing_can_be_written_it_works_all_the_same(tmp_path):
    root = installed(tmp_path / "site")
    (root / "sandbox" / "engines" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    home.write_text("")
    environment = {"XDG_CACHE_HOME": str(home), "NUMBA_DISABLE_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    out, _ = python(TINY, root, **environment)
    assert out == "(3.0, 0.6000000000000001, 0.8)\n"


SLOW = """
from tests.engines.reference.pieces import ball, running, scene_of
for _ in range(2):
    running(scene_of(*(ball(3 * k, 0, name=f"b{k}") for k in range(COUNT))))
"""


@pytest.mark.parametrize(("count", "said"), [(99, ""), (100, "100 bodies are slow without compiled kernels")])
def test_large_scenes_uncompiled_are_said_to_be_slow_once(count, said):
    _, errors = python(SLOW.replace("COUNT", str(count)), NUMBA_DISABLE_JIT="1")
    assert errors == (f"{said}; install them with: pip install -e '.[fast]'\n" if said else "")


def test_large_scenes_compiled_are_not():
    _, errors = python(SLOW.replace("COUNT", "100"), NUMBA_DISABLE_JIT="0")
    assert "slow" not in errors


def test_without_numba_kernels_are_the_functions_themselves():
    code = """
        import sys
        sys.modules["numba"] = None
        from sandbox.engines.common.kernel import COMPILED, kernel
        def twice(x):
            return 2 * x
        assert kernel(twice) is twice
        print(COMPILED)
    """
    assert python(code)[0] == "False\n"
    assert python(f"import sys; sys.modules['numba'] = None\n{TINY}")[0] == "(3.0, 0.6000000000000001, 0.8)\n"
