"""Kernels: identical results with and without numba, in child processes, and messages about compilation."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from functools import cache
from pathlib import Path

import pytest

from sandbox.engines.common.compile_clock import ANNOUNCEMENT
from tests.engines.builders import ROOT

pytestmark = pytest.mark.fail_slow(60)  # child processes and pages

HERE = Path(__file__).resolve().parent


HASHES_SCRIPT = """
import json
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, shipped, simulation_of, small_pile
from tests.engines.stepping import advance

def court(**more):
    balls = [ball(-2 + 1.1 * k, 2 + 0.3 * k, velocity=[9 - 5 * k, -6], name=f"b{k}", friction=0.3) for k in range(4)]
    return scene_of(
        *balls, world={**EARTH, "linear_drag": 0.1, "quadratic_drag": 0.05}, plane=[FLOOR], solver={"dt": 0.02},
        wall=[{"points": [[3, 0], [3, 4], [-4, 5], [-4, 0]], "restitution": 0.7, "friction": 0.2}],
        post=[{"position": [0.5, 1.2], "radius": 0.3, "restitution": 0.9}],
    )

runs = {
    "bounce": advance(simulation_of(shipped("tutorial/bounce")), 1500),
    "pile": advance(simulation_of(small_pile(60)), 40),
    "pile, sweep": advance(simulation_of(small_pile(24), broad_phase="sweep"), 40),
    "pile, circles": advance(simulation_of(small_pile(24), broad_phase="circles"), 40),
    "gas": advance(simulation_of(shipped("benchmark/gas"), dt=0.02, substeps=1), 40),
    "penalty": advance(simulation_of(small_pile(12), response="penalty", substeps=10), 20),
    "bisect": advance(simulation_of(court(), detection="bisect", integrator="velocity_verlet"), 60),
    "swept": advance(simulation_of(court(), detection="swept", integrator="rk4"), 60),
    "shrink": advance(simulation_of(court(), detection="shrink", integrator="leapfrog"), 30),
}
assert all(run.work["contacts"] for run in runs.values())
print(json.dumps({name: run.state_hash() for name, run in runs.items()}))
"""

ONE_KERNEL_SCRIPT = """
from sandbox.engines.reference.manifold import circle_circle
print(circle_circle(0.0, 0.0, 1.0, 3.0, 4.0, 1.0))
"""


def python(code, root=ROOT, **environment):
    """Run code in a child process; return its standard output and standard error."""
    paths = os.pathsep.join((str(root), str(HERE)))
    process = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env={**os.environ, "PYTHONPATH": paths, **environment},
        cwd=root,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout, process.stderr


@cache
def hashes(disabled):
    return json.loads(python(HASHES_SCRIPT, NUMBA_DISABLE_JIT=disabled)[0])


@pytest.mark.nightly  # the court, the pile and the gas take some seconds uncompiled
def test_results_are_bit_identical_with_and_without_compilation():
    assert hashes("0") == hashes("1")


def copy_package(folder):
    """Return a copy of the package whose sources are in no cache."""
    shutil.copytree(ROOT / "sandbox", folder / "sandbox", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_compilation_is_announced_once_and_cached_on_disk(tmp_path):
    root = copy_package(tmp_path)
    first, second = (python(ONE_KERNEL_SCRIPT, root, NUMBA_DISABLE_JIT="0") for _ in range(2))
    assert first[0] == second[0] == "(3.0, 0.6000000000000001, 0.8)\n"
    assert first[1] == ANNOUNCEMENT + "\n"
    assert second[1] == ""


@pytest.mark.parametrize(("age", "left"), [(60, 2), (7200, 1)])
def test_changed_sources_are_recompiled_and_old_caches_removed(tmp_path, age, left):
    root = copy_package(tmp_path)
    python(ONE_KERNEL_SCRIPT, root, NUMBA_DISABLE_JIT="0")
    cache_home = root / "sandbox" / "engines" / "__pycache__"
    (before,) = cache_home.glob("kernels-*")
    modified = before.stat().st_mtime - age
    os.utime(before, (modified, modified))
    # A callee in another file: numba's own cache would not notice the change.
    source = root / "sandbox" / "engines" / "reference" / "broad_phase.py"
    source.write_text(source.read_text() + "\n# changed\n")
    assert python(ONE_KERNEL_SCRIPT, root, NUMBA_DISABLE_JIT="0")[1] == ANNOUNCEMENT + "\n"
    assert len(list(cache_home.glob("kernels-*"))) == left
    assert before.exists() == (left == 2)  # a recent cache may be in use by another process


def test_user_cache_is_used_if_the_installation_is_not_writable(tmp_path):
    root = copy_package(tmp_path / "site")
    # A file in place of the folder: no user, not even root, can write into it.
    (root / "sandbox" / "engines" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    home.mkdir()
    environment = {"XDG_CACHE_HOME": str(home), "NUMBA_DISABLE_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    first, second = (python(ONE_KERNEL_SCRIPT, root, **environment) for _ in range(2))
    assert first[1] == ANNOUNCEMENT + "\n"
    assert second == (first[0], "")
    assert len(list((home / "sandbox2d").glob("kernels-*"))) == 1


def test_full_disk_gives_one_warning_and_kernels_are_recompiled(tmp_path):
    root = copy_package(tmp_path)
    limit = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))\n"
    two = "from sandbox.engines.reference.broad_phase import cell_of\nprint(cell_of(0.5, 2.0))\n"
    for _ in range(2):
        output, errors = python(limit + textwrap.dedent(ONE_KERNEL_SCRIPT) + two, root, NUMBA_DISABLE_JIT="0")
        assert output.startswith("(3.0, 0.6000000000000001, 0.8)\n")
        announced, warning = errors.splitlines()
        assert (announced, "File too large" in warning) == (ANNOUNCEMENT, True)
    left = (file for file in tmp_path.rglob("kernels-*/**/*") if file.is_file())
    assert [file.name for file in left] == []


def test_kernels_work_if_no_cache_is_writable(tmp_path):
    root = copy_package(tmp_path / "site")
    (root / "sandbox" / "engines" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    home.write_text("")
    (tmp_path / f"sandbox2d-{os.getuid()}").write_text("")
    environment = {"XDG_CACHE_HOME": str(home), "NUMBA_DISABLE_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    environment["TMPDIR"] = str(tmp_path)
    out, _ = python(ONE_KERNEL_SCRIPT, root, **environment)
    assert out == "(3.0, 0.6000000000000001, 0.8)\n"


CONCURRENT_SCRIPT = """
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba

from sandbox.engines.common.geometry import length_and_direction
from sandbox.engines.common.kernel import cache_folder, kernel

sys.setswitchinterval(1e-6)  # threads alternate within the creation of a kernel
plain = length_and_direction.py_func
with ThreadPoolExecutor(8) as pool:
    kernels = list(pool.map(kernel, [plain] * 400))
print(sum(Path(each._cache.cache_path).parent == cache_folder() for each in kernels), repr(numba.config.CACHE_DIR))
"""


def test_kernels_created_by_several_threads_are_all_cached_in_the_same_folder():
    assert python(CONCURRENT_SCRIPT, NUMBA_DISABLE_JIT="0", NUMBA_CACHE_DIR="")[0] == "400 ''\n"


LARGE_SCENE_SCRIPT = """
from tests.engines.builders import ball, scene_of, simulation_of
for _ in range(2):
    simulation_of(scene_of(*(ball(3 * k, 0, name=f"b{k}") for k in range(COUNT))))
"""


@pytest.mark.parametrize(("count", "message"), [(99, ""), (100, "100 bodies are slow without compiled kernels")])
def test_large_scene_without_compilation_is_reported_as_slow_once(count, message):
    _, errors = python(LARGE_SCENE_SCRIPT.replace("COUNT", str(count)), NUMBA_DISABLE_JIT="1")
    assert errors == (f"{message}; install them with: pip install -e '.[fast]'\n" if message else "")


def test_large_scene_with_compilation_is_not_reported_as_slow():
    _, errors = python(LARGE_SCENE_SCRIPT.replace("COUNT", "100"), NUMBA_DISABLE_JIT="0")
    assert "slow" not in errors


def test_kernels_are_plain_functions_without_numba():
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
    assert (
        python(f"import sys; sys.modules['numba'] = None\n{ONE_KERNEL_SCRIPT}")[0] == "(3.0, 0.6000000000000001, 0.8)\n"
    )
