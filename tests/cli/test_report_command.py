"""`sandbox report`: one page for several scenes, JSON, exit status."""

from pathlib import Path

import pytest

from sandbox.cli import report as module
from sandbox.measure.compare import Comparison, compare
from sandbox.measure.run.recorder import TooLargeError
from sandbox.scene.compile.scene import Scene
from tests.cli.calling import DROP, FAULTY, document_from, json_of, lines_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

PYMUNK_ONLY = ("--engine", "pymunk")


def scenes(folder: Path) -> list[str]:
    """Write two scenes and return their paths."""
    return [write_scene(folder, DROP.replace("Drop", title), f"{title}.toml") for title in ("First", "Second")]


def test_page_has_every_scene_and_json_the_errors(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    paths, out = scenes(tmp_path), tmp_path / "new" / "page.html"
    document = document_from(capfd, "report", *paths, *PYMUNK_ONLY, "--out", str(out), "--quiet")
    assert [(each["scene"], each["title"]) for each in document["scenes"]] == list(
        zip(paths, ("First", "Second"), strict=True)
    )
    assert document["scenes"][0]["engines"][0]["max_position_error"] > 0.0
    assert document["page"] == str(out)
    assert {"cpu", "cores", "system"} <= set(document["machine"])
    text = out.read_text(encoding="utf-8")
    assert text.count('<figure class="replay"') == 2
    assert text.index(">First<") < text.index(">Second<")


def test_report_is_written_into_a_folder_with_progress_on_stderr(tmp_path, capfd):
    first, second = scenes(tmp_path)
    status, out, err = lines_of(capfd, "report", first, second, *PYMUNK_ONLY, "--out", str(tmp_path / "folder"))
    assert (status, err) == (0, [f"1/2 {first}", f"2/2 {second}"])
    assert out[0].startswith(f"written: {tmp_path / 'folder' / 'report.html'}")
    assert [path.name for path in (tmp_path / "folder").iterdir()] == ["report.html"]


def test_interrupted_report_keeps_finished_scenes(tmp_path, capfd, monkeypatch):
    def interrupt_second(scene: Scene, *args: object, **kwargs: object) -> Comparison:
        if scene.title == "Second":
            raise KeyboardInterrupt
        return compare(scene, ("pymunk",))

    monkeypatch.setattr(module, "compare", interrupt_second)
    status, document, err = json_of(capfd, "report", *scenes(tmp_path), "--out", str(tmp_path / "a.html"))
    assert (status, len(document["scenes"]), document["interrupted"]) == (130, 1, True)
    assert err[-1] == "interrupted: 1 of 2 scenes are complete and kept"
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "Interrupted: the page has 1 of 2 scenes." in text
    assert text.count('<figure class="replay"') == 1


def test_failure_of_one_scene_is_reported_and_the_rest_is_completed(tmp_path, capfd, monkeypatch):
    def fail_first(scene: Scene, *args: object, **kwargs: object) -> Comparison:
        if scene.title == "First":
            raise TooLargeError("too <large>")
        return compare(scene, ("pymunk",))

    monkeypatch.setattr(module, "compare", fail_first)
    status, document, err = json_of(capfd, "report", *scenes(tmp_path), "--out", str(tmp_path / "a.html"), "--quiet")
    assert (status, [each["status"] for each in document["scenes"]]) == (1, ["failed", "ok"])
    assert document["interrupted"] is False
    assert err == [f"{tmp_path / 'First.toml'}: too <large>"]
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "too &lt;large&gt;" in text
    assert text.count('<figure class="replay"') == 1


def test_all_faults_are_reported_before_any_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    faulty, out = write_scene(tmp_path, FAULTY), tmp_path / "a.html"
    status, document, err = json_of(capfd, "report", faulty, "no_such", "--engine", "nope", "--out", str(out))
    assert (status, document["scenes"], document["page"]) == (2, [], None)
    assert len(err) == len(document["faults"]) == 4
    assert not out.exists()


def test_tradeoff_includes_the_compared_settings(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Even a search without effort has the scene's setting of every engine."""
    path = write_scene(tmp_path)
    arguments = ("--effort", "1e-9", "--quiet", "--out", str(tmp_path / "a.html"))
    status, document, _ = json_of(capfd, "report", path, *arguments)
    assert status == 0
    (scene,) = document["scenes"]
    tradeoff = scene["tradeoff"]
    for row in scene["engines"]:
        (point,) = [p for p in tradeoff["points"] if p["engine"] == row["engine"] and p["scene_setting"]]
        assert point["error"] == row["max_position_error"]
    accurate = [row["engine"] for row in scene["engines"] if row["max_position_error"] <= tradeoff["tolerance"]]
    assert accurate
    assert tradeoff["within_tolerance"]["engine"] in accurate
