"""Runs chosen tests in a chosen order, as a pytest plugin: `MUTATION_TESTS` is a file with one test a line."""

import os
from pathlib import Path

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the chosen tests, in their order."""
    order = {test: k for k, test in enumerate(Path(os.environ["MUTATION_TESTS"]).read_text("utf-8").splitlines())}
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in order])
    items[:] = sorted((item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid])
