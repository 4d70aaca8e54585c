"""Examples in docstrings of public functions run, and print the outputs shown there."""

import doctest
import inspect
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import sandbox
from sandbox.cli.main import cli

FUNCTIONS = [name for name in sandbox.__all__ if inspect.isfunction(getattr(sandbox, name))]
WITH_EXAMPLES = [name for name in FUNCTIONS if ">>>" in (getattr(sandbox, name).__doc__ or "")]


@pytest.mark.fail_slow(60)  # imports engines, and may compile functions
@pytest.mark.usefixtures("own_integrators")
@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_of_a_docstring_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = inspect.getdoc(getattr(sandbox, name)) or ""
    if command := re.search(r"After `sandbox (.*)`:", text):
        assert CliRunner().invoke(cli, command[1].split()).exit_code == 0
    test = doctest.DocTestParser().get_doctest(text, {"sandbox": sandbox}, name, None, 0)
    failures: list[str] = []
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(test, out=failures.append)
    assert test.examples and not failures, "".join(failures)


def test_public_functions_have_an_example() -> None:
    assert set(FUNCTIONS) == set(WITH_EXAMPLES)
