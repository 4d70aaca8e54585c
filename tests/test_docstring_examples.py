"""Examples in docstrings of public functions run, and print the outputs shown there."""

import doctest
import inspect

import pytest

import sandbox

FUNCTIONS = [name for name in sandbox.__all__ if inspect.isfunction(getattr(sandbox, name))]
WITH_EXAMPLES = [name for name in FUNCTIONS if ">>>" in (getattr(sandbox, name).__doc__ or "")]


@pytest.mark.fail_slow(60)  # imports engines, and may compile functions
@pytest.mark.usefixtures("own_integrators")
@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_of_a_docstring_run(name: str) -> None:
    text = inspect.getdoc(getattr(sandbox, name)) or ""
    test = doctest.DocTestParser().get_doctest(text, {"sandbox": sandbox}, name, None, 0)
    failures: list[str] = []
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(test, out=failures.append)
    assert test.examples and not failures, "".join(failures)


def test_functions_that_most_programs_call_have_an_example() -> None:
    assert {"load", "loads", "dumps", "run", "start", "compare", "ensemble", "integrate"} <= set(WITH_EXAMPLES)
