"""Saved shots of pooltool, written here in its format."""

import json
from typing import Any

POOL = {"m": 0.170097, "R": 0.028575, "u_s": 0.2, "u_r": 0.01, "u_sp_proportionality": 4 / 9, "u_b": 0.05, "e_b": 0.95}
POOL |= {"e_c": 0.85, "f_c": 0.2, "g": 9.81}
CAROM = POOL | {"m": 0.210, "R": 0.03075, "f_c": 0.15}
NOSE = 0.037
"""m, height of the cushions"""


def ball(name: str, x: float, y: float, params: dict[str, float] | None = None) -> dict[str, Any]:
    """Return a ball at rest."""
    params = params or POOL
    state = {"rvw": [[x, y, params["R"]], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "s": 0, "t": 0.0}
    return {"id": name, "state": state, "params": dict(params), "history": {"states": []}}


def cue(**changes: Any) -> dict[str, Any]:
    """Return a cue that strikes at 1.5 m/s along y, with changes."""
    specs = {"M": 0.567, "end_mass": 0.170097 / 30}
    return {"id": "stick", "V0": 1.5, "phi": 90.0, "theta": 0.0, "a": 0.0, "b": 0.0, "cue_ball_id": "cue"} | {
        "specs": specs,
        **changes,
    }


def document(*balls: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Return a shot on a carom table of 1.42 × 2.84 m, with changes of its cue; default: two balls of pool."""
    ends = {"3": (0, 0, 0, 2.84), "9": (0, 2.84, 1.42, 2.84), "12": (1.42, 2.84, 1.42, 0), "18": (0, 0, 1.42, 0)}
    linear = {
        name: {"id": name, "p1": [float(ax), float(ay), NOSE], "p2": [float(bx), float(by), NOSE], "direction": 2}
        for name, (ax, ay, bx, by) in ends.items()
    }
    table = {"cushion_segments": {"linear": linear, "circular": {}}, "pockets": {}, "table_type": "billiard"}
    placed = balls or (ball("cue", 0.5, 0.7), ball("1", 0.5, 1.7))
    return {
        "cue": cue(**changes),
        "table": table,
        "balls": {each["id"]: each for each in placed},
        "t": 0.0,
        "events": [],
    }


def text_of(shot: dict[str, Any]) -> str:
    """Return a shot as JSON, as Python writes it."""
    return json.dumps(shot)
