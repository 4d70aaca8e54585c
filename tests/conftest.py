"""Shared by all tests: the number of examples of property tests, and no skips on CI."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

ON_CI = bool(os.environ.get("CI"))

# No deadline: no test asserts on time. CI draws three times as many examples, and the same ones every time, so that a
# failure comes from the change; other runs draw new ones.
settings.register_profile("sandbox", deadline=None, max_examples=60 if ON_CI else 20, derandomize=ON_CI)
settings.load_profile("sandbox")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Make a skipped test fail on CI: a green run that left something out is not green."""
    report = yield
    if ON_CI and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped on CI: {report.longrepr}"
    return report
