"""`sandbox compare --minimise`: who parts, the file that the smallest scene goes into, and what is said of it."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sandbox.cli.output import reasons_against
from sandbox.echo import MAX_NAMED, shorten
from sandbox.measure.bounded_run import TookTooLongError
from sandbox.measure.compare import Comparison
from sandbox.measure.compare.disagreement import Disagreement
from sandbox.measure.compare.minimise import Minimised, minimise
from sandbox.measure.told import Told
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import dumps, loads
from sandbox.whole import whole


class Answer(NamedTuple):
    """What came of it."""

    status: int
    sentence: str
    document: dict[str, Any]


def faults_of(path: Path, scene: str, force: bool) -> list[Fault]:
    """Return why a file cannot be written, before anything is run.

    Args:
        path: where the smallest scene would go.
        scene: the file that is to be made smaller.
        force: a file that exists may be replaced.
    """
    reason = next(iter(reasons_against(path)), "")
    if not reason and path.exists():
        if scene and Path(scene).exists() and path.samefile(scene):
            reason = "is the scene itself; name another file"
        elif not force:
            reason = "exists already; add --force to replace it, or name another file: --minimise FILE"
    return [Fault("--minimise", None, "", f"{shorten(str(path), MAX_NAMED)}: {reason}")] if reason else []


def minimised(scene: str, comparison: Comparison, names: Sequence[str] | None, path: Path, told: Told | None) -> Answer:
    """Make the scene of a comparison smaller, and write what is found.

    Args:
        scene: what it is called.
        comparison: of it.
        names: the engines that were asked for. Two are held against each other; else the one that parts from the
            truth first, against that.
        path: where the smallest scene goes.
        told: who is told what is being done.
    """
    engines = _who(comparison, names)
    reason = _no_answer(comparison, engines)
    if reason:
        return _nothing(scene, comparison, reason)
    asked = Disagreement(engines, comparison.tolerance)
    try:
        found = minimise(comparison.scene, asked, told=told)
    except TookTooLongError as error:
        return _nothing(scene, comparison, f"a run of the scene takes too long: {error}")
    if found.parting is None:
        reason = f"{asked} agree within {comparison.tolerance:.2g} m for as long as the comparison is reliable"
        return _nothing(scene, comparison, reason, found.runs)
    document, text = _document(found, path), _text(scene, found, asked, path)
    if asked.of(loads(text)) is None:
        return _nothing(scene, comparison, "the reduced scene does not reproduce the divergence", found.runs)
    try:
        with whole(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        message = f"{path}: {error.strerror or error}"
        return Answer(2, f"--minimise: {message}", {**document, "path": None, "error": message})
    interrupted = found.ended == "interrupted"
    sentence = f"{_counted(found)}, in {found.runs:,} tries\n{_sentence(found, asked)}\nwritten: {path}"
    if found.ended is not None:
        sentence += f"\n{found.ended}: a smaller scene may exist"
    return Answer(130 if interrupted else 0, sentence, document)


def _who(comparison: Comparison, names: Sequence[str] | None) -> list[str]:
    if names is not None and len(names) == 2:
        return list(names)
    off = [row for row in comparison.rows if row.first_divergence is not None]
    first = min(off, key=lambda row: row.first_divergence or 0.0, default=None)
    return [first.engine] if first is not None else []


def _no_answer(comparison: Comparison, engines: Sequence[str]) -> str:
    """Return why there is nobody to disagree; "" where there may be."""
    refusing = [row.engine for row in comparison.rows if row.engine in engines and row.status == "refused"]
    if refusing:
        return f"{' and '.join(refusing)} cannot run the scene"
    if engines:
        return ""
    if comparison.best is None:
        return "no engine can run the scene"
    until = f"up to {comparison.trusted_until:.4g} s"
    return f"no engine differs from the truth by more than {comparison.tolerance:.2g} m {until}"


def _nothing(scene: str, comparison: Comparison, reason: str, runs: int = 0) -> Answer:
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
    return Answer(1, f"{scene}: nothing to minimise: {reason}", document)


def _document(found: Minimised, path: Path) -> dict[str, Any]:
    assert found.parting is not None
    return {
        "path": str(path),
        "bodies_before": found.bodies[0],
        "bodies_after": found.bodies[1],
        "fixed_before": found.fixed[0],
        "fixed_after": found.fixed[1],
        "runs": found.runs,
        "first_divergence": found.parting.time,
        "error": found.ended,
    }


def _counted(found: Minimised) -> str:
    (before, after), (fixed_before, fixed_after) = found.bodies, found.fixed
    fixed = f"{_several(fixed_before, 'fixed object', 'fixed objects')} to {fixed_after:,}"
    return f"minimised: {_several(before, 'body', 'bodies')} to {after:,}, {fixed}"


def _several(number: int, one: str, more: str) -> str:
    return f"{number:,} {one if number == 1 else more}"


def _sentence(found: Minimised, asked: Disagreement) -> str:
    """Say who parts, where and when."""
    parting = found.parting
    assert parting is not None
    who = "" if parting.body is None else f", {json.dumps(parting.body, ensure_ascii=False)} first"
    return f"{asked} differ by more than {asked.tolerance:.4g} m from t = {parting.time:.6g} s on{who}"


def _text(scene: str, found: Minimised, asked: Disagreement, path: Path) -> str:
    """Return the scene's text, its first lines saying what it shows and how to see it."""
    again = (
        f"sandbox compare {shlex.quote(path.name)} --engines {','.join(asked.engines)} --tolerance {asked.tolerance!r}"
    )
    lines = (
        f"{_sentence(found, asked)}.",
        f"{_counted(found).capitalize()}, from {Path(scene).name}.",
        f"Reproduce: {again}",
    )
    shown = ("".join(letter if letter.isprintable() else " " for letter in line) for line in lines)
    words = {"title": f"{found.scene.title or Path(scene).stem}, minimised"[-200:], "about": lines[0]}
    return "".join(f"# {line}\n" for line in shown) + "\n" + dumps(found.scene.model_copy(update=words))
