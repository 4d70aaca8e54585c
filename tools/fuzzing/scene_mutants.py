"""Scene mutants: generated scene files with actions; mutant k of a seed is the same on every machine.

A mutant is a shipped scene with one to three changes, shortened to a few steps. Most changes are valid, so that most
mutants load and run; the others break types, ranges, references or the TOML syntax.
"""

import copy
import math
import random
import re
from collections.abc import Iterator
from typing import Any

from sandbox.engines.registry import ENGINES
from tools.fuzzing.isolated import Case
from tools.fuzzing.mutant_actions import actions
from tools.fuzzing.scene_changes import INVALID_CHANGES, VALID_CHANGES, base_scene
from tools.fuzzing.schema_values import Document

VALID = 0.94
"""Fraction of the changes that are valid."""
TEXTUAL = 0.05
"""Fraction of the mutants whose text is damaged."""
ALSO = {
    "check": 0.3, "compare": 0.02, "session": 0.06, "recording": 0.08, "resume": 0.06, "rewind": 0.05, "store": 0.05,
    "game": 0.2,
}  # fmt: skip
"""Probabilities of additional checks (`scene_cases.EXTRAS`)."""


def scene_cases(seed: int, count: int, first: int = 0) -> Iterator[Case]:
    """Yield the cases of the mutants `first` to `first + count − 1` of a seed."""
    for k in range(first, first + count):
        yield Case("tools.fuzzing.scene_cases:run_scene", argument(seed, k), f"mutant {k} of seed {seed}")


def argument(seed: int, index: int) -> Document:
    """Return the argument of `scene_cases.run_scene` for one mutant."""
    draw = random.Random(f"{seed}:{index}")
    document = copy.deepcopy(base_scene(draw))
    shorten(document, draw)
    for _ in range(draw.choice((1, 1, 2, 2, 3))):
        change = draw.choice(VALID_CHANGES if draw.random() < VALID else INVALID_CHANGES)
        change(document, draw)
    text = to_toml(document)
    case: Document = {"text": text}
    if draw.random() < TEXTUAL:
        case = damaged(text, draw)
    if draw.random() < 0.7:
        case["actions"] = actions(document, draw)
    case["runs"] = [_run(engine, draw) for engine in ENGINES]
    case["also"] = [each for each, odds in ALSO.items() if draw.random() < odds]
    return case


def _run(engine: str, draw: random.Random) -> Document:
    return {
        "engine": engine,
        "steps": draw.choice((1, 5, 10, 20)),
        "public": draw.random() < 0.4,
        "audit": draw.random() < 0.4,
        "account": draw.random() < 0.3,
    }


def shorten(document: Document, draw: random.Random) -> None:
    """Shorten the duration of a scene to a few steps."""
    dt = document.get("solver", {}).get("dt", 0.01)
    if draw.random() < 0.97:
        document.setdefault("world", {})["duration"] = dt * draw.choice((1, 3, 8, 15, 15.5, 25))


def to_toml(document: Document) -> str:
    """Return a document with any keys and values as TOML; None becomes an empty text."""
    plain, tables = [], []
    for key, value in document.items():
        heading = _toml_key(key)
        if isinstance(value, dict):
            tables.append(f"[{heading}]\n{_toml_lines(value)}")
        elif isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
            tables += [f"[[{heading}]]\n{_toml_lines(each)}" for each in value]
        else:
            plain.append(f"{heading} = {_toml_value(value)}\n")
    return "\n".join(["".join(plain), *tables])


def _toml_lines(table: Document) -> str:
    return "".join(f"{_toml_key(key)} = {_toml_value(value)}\n" for key, value in table.items())


def _toml_key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _toml_text(key)


def _toml_text(text: str) -> str:
    return re.sub(r"[\x00-\x1f\x7f]", lambda found: f"\\u{ord(found[0]):04x}",
                  '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"')  # fmt: skip


def _toml_value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case dict():
            return "{" + ", ".join(f"{_toml_key(key)} = {_toml_value(inner)}" for key, inner in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_toml_value, value)) + "]"
        case str():
            return _toml_text(value)
        case None:
            return '""'
        case float():
            return repr(value) if math.isfinite(value) else str(value)
    return str(value) if abs(value) < 10**300 else "1" + "0" * 400


def damaged(text: str, draw: random.Random) -> Document:
    """Return a case argument with a damaged text: `text`, and `times` if a part of it is repeated."""
    position = draw.randrange(len(text) + 1)
    before, after = text[:position], text[position:]
    match draw.randrange(9):
        case 0:
            return {"text": before}
        case 1:
            return {
                "text": before + chr(draw.choice((0, 7, 10, 13, 34, 39, 61, 91, 93, 123, 125, 233, 0x10FFFF))) + after
            }
        case 2:
            return {"text": before + after[draw.randrange(1, 40) :]}
        case 3:
            lines = text.split("\n")
            draw.shuffle(lines)
            return {"text": "\n".join(lines)}
        case 4:
            return {"text": text + "\n" + text}
        case 5:
            return {"text": text.replace("\n", draw.choice(("\r\n", "\r", "\n\n", " ")))}
        case _:
            opened, middle, closed = draw.choice(_NESTED)
            count = draw.choice((10, 100, 1000, 10_000, 100_000))
            line = draw.choice((True, True, False))
            parts = [
                f"{text}\n" if line else before,
                opened,
                middle,
                closed if draw.random() < 0.8 else "",
                "\n",
                after,
            ]
            return {"text": parts[:5] + ([] if line else [after]), "times": {"1": count, "3": count}}


_NESTED = (
    ("[", "", "]"), ("[", "1", "]"), ("{a = ", "1", "}"), ("a.", "b = 1", ""), ("x = [", "", "]"), ("[a", "", "]"),
    ("[{a = ", "1", "}]"), ("[[", "a", "]]"), ("a = 1\n", "", ""), ("[[ball]]\n", "", ""), ("1", "", ""),
    ('"""', "", ""), ("a = [1, ", "", "]"), ("[a.", "a", "]\n"), ('"', "", ""), ("# ", "", "\n"),
    ("x" * 100, " = 1", ""),
)  # fmt: skip
"""Repeated opening text, text in the middle, and repeated closing text, inserted on a separate line or anywhere."""
