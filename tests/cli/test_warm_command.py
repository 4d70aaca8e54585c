"""`sandbox warm`: runs every warm-up, and says why nothing can be compiled."""

from pathlib import Path

import pytest

from sandbox.engines.common import kernel
from sandbox.window import warm_up
from tests.cli.calling import lines_of

pytestmark = pytest.mark.fail_slow(60)  # a comparison of all engines


@pytest.mark.parametrize("quiet", [True, False])
def test_every_warm_up_is_run(quiet: bool, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    if not kernel.COMPILED:
        pytest.skip("nothing is compiled")
    entries = dict(list(warm_up.warm_ups().items())[:5])
    run: list[str] = []
    monkeypatch.setattr(warm_up, "warm_ups", lambda: entries)
    monkeypatch.setattr(
        warm_up, "warm_up", lambda scene, engine, settings, on_part: run.append(f"{engine} {scene.title}")
    )
    status, out, err = lines_of(capfd, "warm", *(["--quiet"] if quiet else []))
    assert (status, err, len(out)) == (0, [], 0 if quiet else 1)
    assert run == [f"{engine} {scene.title}" for scene, engine in entries.values()]


@pytest.mark.parametrize(("name", "value"), [("COMPILED", False), ("cache_folder", lambda: None)])
def test_reason_is_given_if_nothing_can_be_compiled(
    name: str, value: object, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel, name, value)
    status, out, err = lines_of(capfd, "warm")
    assert (status, out, len(err)) == (1, [], 1)
