"""Shared by all tests; being here, it also makes `strategies` importable from every folder."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

# No test asserts on time. CI draws the same examples every time, so that it tells of the change and not of luck;
# a developer's runs draw new ones.
settings.register_profile("sandbox", deadline=None, max_examples=60, derandomize="CI" in os.environ)
settings.load_profile("sandbox")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Make a skipped test fail on CI: a green run that left something out is not green."""
    report = yield
    if os.environ.get("CI") and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped on CI: {report.longrepr}"
    return report
