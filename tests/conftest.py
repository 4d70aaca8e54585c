"""Settings of all tests: examples of property tests, time budgets, shards of the nightly tests, no skips on CI."""

import os
from collections.abc import Iterator
from hashlib import blake2b

import pytest
from hypothesis import settings

ON_CI = bool(os.environ.get("CI"))

# No deadline: no test asserts on time. CI draws the same examples in every run, so that a failure is due to the change
# under test. `.ci/nightly` draws new ones, and prints how to repeat a failure.
settings.register_profile("sandbox", deadline=None, max_examples=20, derandomize=ON_CI)
settings.register_profile("fresh", deadline=None, max_examples=60, print_blob=True)
settings.register_profile("nightly", deadline=None, max_examples=300, print_blob=True)
settings.load_profile("sandbox")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--shard", metavar="K/N", help="run the K-th of N parts of the tests, K from 1 to N")


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Enforce the time budgets of tests on CI only: elsewhere compilation, or a slow machine, is no failure."""
    if not ON_CI and (plugin := config.pluginmanager.get_plugin("fail-slow")):
        config.pluginmanager.unregister(plugin)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the tests of a shard. The digest of a test's name decides, so that other tests do not move it."""
    if shard := config.getoption("--shard"):
        part, count = map(int, shard.split("/"))
        parts: list[list[pytest.Item]] = [[], []]
        for item in items:
            digest = blake2b(item.nodeid.encode(), digest_size=8).digest()
            parts[int.from_bytes(digest) % count == part - 1].append(item)
        others, items[:] = parts
        config.hook.pytest_deselected(items=others)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Make a skipped test fail on CI, where every test has to run."""
    report = yield
    if ON_CI and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped on CI: {report.longrepr}"
    return report
