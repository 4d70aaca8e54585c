"""The engines that model drives, for tests that hold for each of them."""

from functools import partial

import pytest

from sandbox.engines import switching as relay


@pytest.fixture(params=("pymunk", "reference"), scope="module")
def engine(request):
    """The name of an engine that models drives."""
    return request.param


@pytest.fixture(scope="module")
def start(engine):
    """What starts a scene on that engine."""
    return partial(relay.start, engine=engine)
