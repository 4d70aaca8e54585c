"""What pages are made of in tests: a scene, a trade-off, extremes; all with texts that would do harm if they could."""

from typing import Any

HOSTILE = """</script><img src="x" onerror="window.harm=1">'"&amp;"""
"""Ends a script, and starts one of its own."""

SCENE = f"""
title = '''<b id="harm">Title</b>'''
about = '''{HOSTILE}</style><script>window.harm=1</script>'''

[world]
gravity = [0.0, -10.0]
duration = 1.0

[solver]
dt = 0.01

[[plane]]
name = '''{HOSTILE}'''
point = [0.0, 0.0]
normal = [0.0, 1.0]

[[wall]]
points = [[3.0, 0.0], [3.0, 2.0]]
thickness = 0.1

[[post]]
position = [-2.0, 0.5]
radius = 0.2

[[ball]]
name = '''{HOSTILE} ball'''
position = [0.0, 1.5]
velocity = [1.0, 0.0]
radius = 0.5
restitution = 0.5
"""


def settings(dt: float, **more: Any) -> dict[str, Any]:
    """Return settings as a document has them."""
    return {"dt": dt, "substeps": 1, "iterations": 10, "slop": None, "half_kick": False, "record_every": 1, **more}


def point(engine: str, dt: float, error: float | None, cost: float | None, **more: Any) -> dict[str, Any]:
    """Return a point of a trade-off."""
    return {
        "engine": engine,
        "settings": settings(dt, integrator=more.pop("integrator", None)),
        "changes": {"dt": dt},
        "error": error,
        "cost_ms_per_second": cost,
        "cost_median_ms_per_second": cost,
        "repeats": 3,
        "status": "ok",
        "reason": None,
        "metrics": {"max_position": error, "energy": 0.25},
        "work": {"substeps": round(1.0 / dt)},
        **more,
    }


def tradeoff_document() -> dict[str, Any]:
    """Return a trade-off of two engines, with a failure and a method of its own."""
    points = [
        point("pymunk", 0.01, 0.1, 2.0),
        point("pymunk", 0.001, 0.01, 20.0),
        point("pymunk", 0.1, None, None, status="diverged", reason=HOSTILE),
        point("reference", 0.01, 0.05, 5.0),
        point("reference", 0.01, 0.001, 8.0, integrator="velocity_verlet"),
        point("exact", 0.01, 0.0, 30.0),
    ]
    parts = {"total": 0.1, "model": 0.02, "time_step": 0.07, "solver": 0.01, "left": 0.0}
    return {
        "scene": "scene.toml",
        "title": HOSTILE,
        "truth": "closed_form",
        "truth_about": "formulas",
        "trusted_until": 1.0,
        "metric": "max_position",
        "unit": "m",
        "points": points,
        "pareto": [points[0], points[3], points[4], points[5]],
        "floors": {"pymunk": 0.005},
        "split": [{"engine": "pymunk", "settings": settings(0.01), **parts}],
        "proposals": [
            {
                "what": "closed form",
                "engine": None,
                "error": 0.0,
                "cost_ms_per_second": 0.1,
                "ratio": 0.05,
                "sentence": HOSTILE,
            }
        ],
        "tolerance": 0.02,
        "budget": 0.5,
        "fps": 60.0,
        "within_tolerance": points[4],
        "within_budget": None,
        "answers": [f"cheapest: {HOSTILE}"],
        "machine": {"cpu": "a <processor>", "cores": 2},
        "versions": {"python": "3"},
    }


def extremes_document() -> dict[str, Any]:
    """Return extremes of one axis and a pair of axes."""
    verdicts = ("exact", "degraded", "refused", "failed")
    row = {"axis": "time_step", "engine": "pymunk", "settings": {"substeps": 4}, "reason": HOSTILE}
    pair = {"axis": "time_step × mass_ratio", "engine": "exact", "settings": {}, "reason": "broke", "verdict": "failed"}
    counts = {"true_positives": 3, "false_positives": 1, "false_negatives": 0, "true_negatives": 9}
    return {
        "cells": [
            *({**row, "level": 10.0**k, "verdict": verdict} for k, verdict in enumerate(verdicts)),
            {**pair, "level": [1.0, 100.0]},
        ],
        "limits": [{**row, "limit": 10.0, "first_failure": 1000.0}],
        "predictions": [{"kind": "tunnelling", "precision": 0.75, "recall": 1.0, **counts}],
    }
