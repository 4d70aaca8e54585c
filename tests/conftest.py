"""Settings of all tests: number of examples of property tests; a skip on CI is a failure."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

ON_CI = bool(os.environ.get("CI"))

# No deadline: no test asserts on time. CI draws three times as many examples, and the same ones in every run, so that a
# failure is due to the change under test; other runs draw new examples.
settings.register_profile("sandbox", deadline=None, max_examples=60 if ON_CI else 20, derandomize=ON_CI)
settings.load_profile("sandbox")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Make a skipped test fail on CI, where every test has to run."""
    report = yield
    if ON_CI and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped on CI: {report.longrepr}"
    return report
