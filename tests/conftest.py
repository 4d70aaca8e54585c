"""Settings of all tests: examples of property tests, time budgets, shards of the nightly tests, no skips on CI."""

import os
import re
from collections.abc import Iterator
from hashlib import blake2b
from pathlib import Path

import pytest
from hypothesis import settings

from sandbox.engines.common.compile_clock import COMPILE_CLOCK

WHOLE_FILE = re.compile(r"^pytestmark = pytest\.mark\.(?:nightly|fail_slow)", re.MULTILINE)
"""Text of a file of which no test belongs to the core."""

FEW_KERNELS = tuple(f"tests/{folder}/" for folder in ("docs", "games", "levels", "report", "scene", "window"))
"""Folders whose tests need few compiled kernels."""

ON_CI = bool(os.environ.get("CI"))

# No deadline: no test asserts on time. CI draws the same examples in every run, so that a failure is due to the change
# under test. `.ci/nightly` draws new ones, and prints how to repeat a failure.
settings.register_profile("sandbox", deadline=None, max_examples=20, derandomize=ON_CI)
settings.register_profile("fresh", deadline=None, max_examples=60, print_blob=True)
settings.register_profile("nightly", deadline=None, max_examples=300, print_blob=True)
settings.load_profile("sandbox")

COMPILE_SECONDS = pytest.StashKey[float]()
"""s, spent compiling kernels in this process during a test; its time budget leaves this out"""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--shard", metavar="K/N", help="run the K-th of N parts of the tests, K from 1 to N")


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Enforce the time budgets of tests on CI only: elsewhere compilation, or a slow machine, is no failure."""
    if not ON_CI and (plugin := config.pluginmanager.get_plugin("fail-slow")):
        config.pluginmanager.unregister(plugin)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not import files without a test of the core, if only the core runs: to import all takes a minute at first."""
    is_core = config.option.markexpr in config.getini("addopts")
    if not is_core or collection_path.suffix != ".py":
        return None
    return "exact" in collection_path.parts or WHOLE_FILE.search(collection_path.read_text("utf-8")) is not None or None


def pytest_itemcollected(item: pytest.Item) -> None:
    """Keep tests with the parameter `exact` out of the core: to compile its kernels takes minutes."""
    if "exact" in item.nodeid.partition("[")[2]:
        item.add_marker(pytest.mark.fail_slow(60))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Order the tests, and keep those of a shard.

    Tests that need few kernels are last, because a second worker begins in the middle: so it does not compile what the
    first one is compiling. The digest of a test's name decides its shard, so that other tests do not move it.
    """
    items.sort(key=lambda item: item.nodeid.startswith(FEW_KERNELS))
    if shard := config.getoption("--shard"):
        part, count = map(int, shard.split("/"))
        parts: list[list[pytest.Item]] = [[], []]
        for item in items:
            digest = blake2b(item.nodeid.encode(), digest_size=8).digest()
            parts[int.from_bytes(digest) % count == part - 1].append(item)
        others, items[:] = parts
        config.hook.pytest_deselected(items=others)


@pytest.fixture
def own_integrators() -> Iterator[None]:
    """Remove the integrators that a test adds."""
    from sandbox.engines.reference.integrators import INTEGRATORS
    from sandbox.scene.description.world import ADDED_INTEGRATORS

    yield
    for name in ADDED_INTEGRATORS:
        del INTEGRATORS[name]  # type: ignore[arg-type]  # added at run time
    ADDED_INTEGRATORS.clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measure the compilation of kernels during a test: any test may be the first to need one."""
    before = COMPILE_CLOCK.seconds
    try:
        return (yield)
    finally:
        item.stash[COMPILE_SECONDS] = COMPILE_CLOCK.seconds - before


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Leave compilation out of a test's time, and make a skipped test fail on CI, where every test has to run."""
    if call.when == "call":
        call.duration -= item.stash.get(COMPILE_SECONDS, 0.0)
    report = yield
    if ON_CI and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped on CI: {report.longrepr}"
    return report
