"""Fixtures for tests that hold for every engine that models drives."""

from functools import partial

import pytest

from sandbox.engines import switching


@pytest.fixture(params=("pymunk", "reference"), scope="module")
def engine(request):
    """Return the name of an engine that models drives."""
    return request.param


@pytest.fixture(scope="module")
def start(engine):
    """Return a function that starts a scene on that engine."""
    return partial(switching.start, engine=engine)
