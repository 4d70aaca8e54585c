"""`sandbox report`: one page over many scenes, its JSON, its exit status."""

from pathlib import Path

import pytest

from sandbox.cli import report as module
from sandbox.cli.main import call
from sandbox.measure.compare import Comparison, compare
from sandbox.measure.run.recorder import TooLargeError
from sandbox.scene.compile.scene import Scene
from tests.cli.calling import DROP, FAULTY, json_of, lines_of, written

pytestmark = pytest.mark.full  # child processes and command lines that run long

ONLY = ("--engine", "pymunk")


def scenes(folder: Path) -> list[str]:
    """Write two scenes and return their paths."""
    return [written(folder, DROP.replace("Drop", title), f"{title}.toml") for title in ("First", "Second")]


def test_page_has_every_scene_and_json_its_figures(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given, out = scenes(tmp_path), tmp_path / "new" / "page.html"
    status, document, err = json_of(capfd, "report", *given, *ONLY, "--out", str(out), "--quiet")
    assert (status, err) == (0, [])
    assert [(each["scene"], each["title"]) for each in document["scenes"]] == list(
        zip(given, ("First", "Second"), strict=True)
    )
    assert document["scenes"][0]["engines"][0]["max_position_error"] > 0.0
    assert document["page"] == str(out)
    assert {"cpu", "cores", "system"} <= set(document["machine"])
    text = out.read_text(encoding="utf-8")
    assert text.count('<figure class="replay"') == 2
    assert text.index(">First<") < text.index(">Second<")


def test_folder_gets_report_html_and_progress_is_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    first, second = scenes(tmp_path)
    status, out, err = lines_of(capfd, "report", first, second, *ONLY, "--out", str(tmp_path / "folder"))
    assert (status, err) == (0, [f"1/2 {first}", f"2/2 {second}"])
    assert out[0].startswith(f"written: {tmp_path / 'folder' / 'report.html'}")
    assert [path.name for path in (tmp_path / "folder").iterdir()] == ["report.html"]


def test_interrupt_keeps_what_is_finished(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def once(scene: Scene, *arguments: object, **more: object) -> Comparison:
        if scene.title == "Second":
            raise KeyboardInterrupt
        return compare(scene, ("pymunk",))

    monkeypatch.setattr(module, "compare", once)
    status, document, err = json_of(capfd, "report", *scenes(tmp_path), "--out", str(tmp_path / "a.html"))
    assert (status, len(document["scenes"]), document["interrupted"]) == (130, 1, True)
    assert err[-1] == "interrupted: 1 of 2 scenes are complete and kept"
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "Interrupted: the page has 1 of 2 scenes." in text
    assert text.count('<figure class="replay"') == 1


def test_scene_that_fails_is_told_and_the_rest_goes_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def some(scene: Scene, *arguments: object, **more: object) -> Comparison:
        if scene.title == "First":
            raise TooLargeError("too <large>")
        return compare(scene, ("pymunk",))

    monkeypatch.setattr(module, "compare", some)
    status, document, err = json_of(capfd, "report", *scenes(tmp_path), "--out", str(tmp_path / "a.html"), "--quiet")
    assert (status, [each["status"] for each in document["scenes"]]) == (1, ["failed", "ok"])
    assert document["interrupted"] is False
    assert err == [f"{tmp_path / 'First.toml'}: too <large>"]
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "too &lt;large&gt;" in text
    assert text.count('<figure class="replay"') == 1


def test_all_faults_are_told_before_anything_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    faulty, out = written(tmp_path, FAULTY), tmp_path / "a.html"
    status, document, err = json_of(capfd, "report", faulty, "no_such", "--engine", "nope", "--out", str(out))
    assert (status, document["scenes"], document["page"]) == (2, [], None)
    assert len(err) == len(document["faults"]) == 4
    assert not out.exists()


def test_out_that_cannot_be_written_is_status_2(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken").write_text("")
    status, out, err = lines_of(capfd, "report", written(tmp_path), "--out", str(tmp_path / "taken" / "a.html"))
    assert (status, out, len(err)) == (2, [], 1)
    assert err[0].startswith("--out: ")


def test_out_is_asked_for(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["report", written(tmp_path)]) == 2
    assert "--out" in capfd.readouterr().err


@pytest.mark.parametrize("flag", ["--effort", "--time-limit", "--patience"])
def test_bound_without_end_is_a_fault(tmp_path: Path, capfd: pytest.CaptureFixture[str], flag: str) -> None:
    status, _, err = lines_of(capfd, "report", *scenes(tmp_path), flag, "inf", "--out", str(tmp_path / "r.html"))
    named = flag.replace("patience", "time-limit")
    assert (status, len(err)) == (2, 1)
    assert err[0].startswith(f"{named}: is inf")


def test_what_a_comparison_found_right_is_an_answer_of_its_tradeoff(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Even a search of no effort has every engine's own setting."""
    given = written(tmp_path)
    arguments = ("--effort", "1e-9", "--quiet", "--out", str(tmp_path / "a.html"))
    status, document, _ = json_of(capfd, "report", given, *arguments)
    assert status == 0
    (scene,) = document["scenes"]
    weighed = scene["tradeoff"]
    for row in scene["engines"]:
        (point,) = [p for p in weighed["points"] if p["engine"] == row["engine"] and p["scene_setting"]]
        assert point["error"] == row["max_position_error"]
    right = [row["engine"] for row in scene["engines"] if row["max_position_error"] <= weighed["tolerance"]]
    assert right
    assert weighed["within_tolerance"]["engine"] in right
