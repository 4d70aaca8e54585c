"""Option `--minimise` of `compare`: reduce a scene on which engines diverge, and write the smallest one."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sandbox.atomic_write import atomic_write
from sandbox.cli.common import reasons_not_writable
from sandbox.echo import MAX_NAMED, shorten
from sandbox.formatting import format_plural
from sandbox.measure.compare import Comparison
from sandbox.measure.compare.reduce import DivergenceTest, ReducedScene, minimise
from sandbox.measure.run.bounded_run import RunTimeoutError
from sandbox.progress import ProgressCallback
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import dumps, loads


class MinimiseAnswer(NamedTuple):
    """Result of a reduction."""

    status: int
    """exit status"""
    sentence: str
    """text for the user"""
    document: dict[str, Any]
    """JSON document"""


def faults_of(path: Path, scene: str, force: bool) -> list[Fault]:
    """Return the faults of the file to write; called before anything is run.

    Args:
        path: file for the smallest scene.
        scene: file of the scene to reduce.
        force: an existing file may be replaced.
    """
    reason = next(iter(reasons_not_writable(path)), "")
    if not reason and path.exists():
        if scene and Path(scene).exists() and path.samefile(scene):
            reason = "is the scene itself; name another file"
        elif not force:
            reason = "exists already; add --force to replace it, or name another file: --minimise FILE"
    return [Fault.of("--minimise", f"{shorten(str(path), MAX_NAMED)}: {reason}")] if reason else []


def minimised(
    scene: str, comparison: Comparison, names: Sequence[str] | None, path: Path, progress: ProgressCallback | None
) -> MinimiseAnswer:
    """Reduce the scene of a comparison, and write the smallest scene.

    Args:
        scene: the scene as the user named it.
        comparison: its comparison.
        names: engines that the user named. Two are compared with each other; otherwise the engine that diverges first
            from the truth is compared with the truth.
        path: file for the smallest scene.
        progress: called with the progress.
    """
    engines = _diverging(comparison, names)
    reason = _obstacle(comparison, engines)
    if reason:
        return _no_reduction(scene, comparison, reason)
    test = DivergenceTest(engines, comparison.tolerance)
    try:
        found = minimise(comparison.scene, test, on_progress=progress)
    except RunTimeoutError as error:
        return _no_reduction(scene, comparison, f"a run of the scene takes too long: {error}")
    if found.divergence is None:
        reason = f"{test} agree within {comparison.tolerance:.2g} m for as long as the comparison is reliable"
        return _no_reduction(scene, comparison, reason, found.runs)
    document, text = _document(found, path), _text(scene, found, test, path)
    if test.of(loads(text)) is None:
        return _no_reduction(scene, comparison, "the reduced scene does not reproduce the divergence", found.runs)
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        message = f"{path}: {error.strerror or error}"
        return MinimiseAnswer(2, f"--minimise: {message}", {**document, "path": None, "error": message})
    interrupted = found.ended == "interrupted"
    sentence = f"{_counted(found)}, in {found.runs:,} tries\n{_sentence(found, test)}\nwritten: {path}"
    if found.ended is not None:
        sentence += f"\n{found.ended}: a smaller scene may exist"
    return MinimiseAnswer(130 if interrupted else 0, sentence, document)


def _diverging(comparison: Comparison, names: Sequence[str] | None) -> list[str]:
    """Return the two engines to compare, or the one to compare with the truth; empty if none diverges."""
    if names is not None and len(names) == 2:
        return list(names)
    diverged = [row for row in comparison.rows if row.first_divergence is not None]
    first = min(diverged, key=lambda row: row.first_divergence or 0.0, default=None)
    return [first.engine] if first is not None else []


def _obstacle(comparison: Comparison, engines: Sequence[str]) -> str:
    """Return the reason why there is nothing to reduce; "" if there is none."""
    refusing = [row.engine for row in comparison.rows if row.engine in engines and row.status == "refused"]
    if refusing:
        return f"{' and '.join(refusing)} cannot run the scene"
    if engines:
        return ""
    if comparison.best is None:
        return "no engine can run the scene"
    until = f"up to {comparison.trusted_until:.4g} s"
    return f"no engine differs from the truth by more than {comparison.tolerance:.2g} m {until}"


def _no_reduction(scene: str, comparison: Comparison, reason: str, runs: int = 0) -> MinimiseAnswer:
    bodies, fixed = len(comparison.scene.bodies), len(comparison.scene.fixed)
    document: dict[str, Any] = {
        "path": None,
        "bodies_before": bodies,
        "bodies_after": bodies,
        "fixed_before": fixed,
        "fixed_after": fixed,
        "runs": runs,
        "first_divergence": None,
        "error": reason,
    }
    return MinimiseAnswer(1, f"{scene}: nothing to minimise: {reason}", document)


def _document(found: ReducedScene, path: Path) -> dict[str, Any]:
    assert found.divergence is not None
    return {
        "path": str(path),
        "bodies_before": found.bodies[0],
        "bodies_after": found.bodies[1],
        "fixed_before": found.fixed[0],
        "fixed_after": found.fixed[1],
        "runs": found.runs,
        "first_divergence": found.divergence.time,
        "error": found.ended,
    }


def _counted(found: ReducedScene) -> str:
    (before, after), (fixed_before, fixed_after) = found.bodies, found.fixed
    fixed = f"{format_plural(fixed_before, 'fixed object')} to {fixed_after:,}"
    return f"minimised: {format_plural(before, 'body', 'bodies')} to {after:,}, {fixed}"


def _sentence(found: ReducedScene, test: DivergenceTest) -> str:
    """Return the engines that diverge, the time of the divergence, and the first body to diverge."""
    parting = found.divergence
    assert parting is not None
    first = "" if parting.body is None else f", {json.dumps(parting.body, ensure_ascii=False)} first"
    return f"{test} differ by more than {test.tolerance:.4g} m from t = {parting.time:.6g} s on{first}"


def _text(scene: str, found: ReducedScene, test: DivergenceTest, path: Path) -> str:
    """Return the scene as TOML, with comments on its divergence and on how to reproduce it."""
    command = (
        f"sandbox compare {shlex.quote(path.name)} --engines {','.join(test.engines)} --tolerance {test.tolerance!r}"
    )
    lines = (
        f"{_sentence(found, test)}.",
        f"{_counted(found).capitalize()}, from {Path(scene).name}.",
        f"Reproduce: {command}",
    )
    comments = ("".join(letter if letter.isprintable() else " " for letter in line) for line in lines)
    words = {"title": f"{found.scene.title or Path(scene).stem}, minimised"[-200:], "about": lines[0]}
    return "".join(f"# {line}\n" for line in comments) + "\n" + dumps(found.scene.model_copy(update=words))
