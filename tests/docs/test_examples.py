"""Code, commands and scenes of README and documentation run, and print the outputs shown there."""

from pathlib import Path

import pytest

from tests.docs.examples import PAGES, ROOT, examples, processes, run_page

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

MAX_PROCESSES = 1
"""Largest number of commands of a page in the fast tests; each takes a second or more."""

SLOW = [pytest.mark.nightly, pytest.mark.fail_slow(300)]
"""Marks of the other pages. The search in README takes a minute, and twice that if it compiles kernels."""


def _parameters() -> list[object]:
    return [pytest.param(page, id=str(page.relative_to(ROOT)), marks=SLOW if _is_slow(page) else []) for page in PAGES]


def _is_slow(page: Path) -> bool:
    return processes(page) > MAX_PROCESSES or any(each.slow for each in examples(page))


@pytest.mark.timeout(1200)  # a page with measurements on a busy machine
@pytest.mark.usefixtures("own_integrators")
@pytest.mark.parametrize("page", _parameters())
def test_examples_of_a_page_run(page: Path, tmp_path: Path) -> None:
    assert list(run_page(page, tmp_path)) == []


def test_wrong_examples_are_detected(tmp_path: Path) -> None:
    text = (
        "```python\nprint(1)\n```\n```text\n2\n```\n\n```sh\nsandbox nonsense\n```\n\n"
        "```console\n$ sandbox schema ball | head -1\nbox: …\n```\n\n"
        "```console\n$ echo unexpected\n```\n\n```toml\n[world]\ngravty = [0, 0]\n```\n"
    )
    path = tmp_path / "wrong.md"
    path.write_text(text, encoding="utf-8")
    assert len(list(run_page(path, tmp_path))) == 5
