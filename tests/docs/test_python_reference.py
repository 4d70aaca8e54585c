"""docs/reference/python.md lists every public name, and only names that exist."""

import importlib
import re
from pathlib import Path

import pytest

import sandbox

PAGE = (Path(__file__).parents[2] / "docs/reference/python.md").read_text(encoding="utf-8")
DIRECTIVES = re.findall(r"^\.\. (?:auto\w+|py:data):: (\S+)$", PAGE, flags=re.MULTILINE)
MODELS = re.findall(r"^```\{generated\} (?:model|classes) (.+)$", PAGE, flags=re.MULTILINE)
DOCUMENTED = {*DIRECTIVES, *(f"sandbox.{name}" for line in MODELS for name in line.split())}


def test_every_public_name_is_documented() -> None:
    assert {f"sandbox.{name}" for name in sandbox.__all__} - DOCUMENTED == set()


@pytest.mark.parametrize("name", sorted(DOCUMENTED))
def test_every_documented_name_exists(name: str) -> None:
    if name.startswith("sandbox.gym."):
        pytest.importorskip("gymnasium")
    first, *rest = name.removeprefix("sandbox.").split(".")
    if first in sandbox.__all__:
        found: object = getattr(sandbox, first)
    else:
        module, _, attribute = name.rpartition(".")
        found, rest = importlib.import_module(module), [attribute]
    for attribute in rest:
        assert hasattr(found, attribute) or attribute in getattr(found, "model_fields", {}), name
        found = getattr(found, attribute, None)
