"""JSON Schemas of the documents that commands print with `--json`."""

import importlib
from typing import Any

from sandbox.jsonable import json_schema

DOCUMENTS = {
    "advise": "sandbox.measure.advice.result:Advice",
    "advise-game": "sandbox.measure.game_advice.result:GameAdvice",
    "check": "sandbox.cli.check:CheckDocument",
    "compare": "sandbox.measure.compare.result:Comparison",
    "extremes": "sandbox.measure.extremes.runner:Extremes",
    "match": "sandbox.cli.games:MatchResult",
    "rehearse": "sandbox.cli.rehearse:RehearsalDocument",
    "run": "sandbox.cli.run_tables:RunsDocument",
    "runs": "sandbox.cli.runs:StoredRunsDocument",
    "shots": "sandbox.measure.shots.study:ShotStudy",
    "tradeoff": "sandbox.measure.tradeoff.result:Tradeoff",
}
"""Dataclass of the document of each command, as `module:class`; `advise-game` is that of `advise GAME.py`."""


def document_schema(command: str) -> dict[str, Any]:
    """Return the JSON Schema of the document of a command.

    The document itself may have further keys: an option can add its own, such as `minimised` of `compare --minimise`.

    Args:
        command: name of the command, one of `DOCUMENTS`.
    """
    module, name = DOCUMENTS[command].split(":")
    return json_schema(getattr(importlib.import_module(module), name), is_open=True)
