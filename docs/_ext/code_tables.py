"""Generators of the reference: Markdown from the code, by name."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import fields
from types import NoneType
from typing import get_args, get_type_hints

from environment_tables import arguments, classic, classics, environment, environments
from gallery import gallery
from python_tables import classes, input_script, model_fields
from replays import replay
from scene_tables import cell, scene_overview, scene_tables, top_keys

import sandbox
from sandbox.batch.stored_run import StoredRun
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import ENGINES
from sandbox.game_names import games_with_rules
from sandbox.games.billiards.view.controls import CUE_KEY_HELP
from sandbox.games.registry import required_rules
from sandbox.measure.compare.metrics import METRICS
from sandbox.resource_limits import LIMITS
from sandbox.run_file import KINDS, OPTIONAL, SHAPES
from sandbox.scene.compile.demands import Demand
from sandbox.scene.description.base import BACKING, MAX_BODIES, MAX_POSITION, MAX_SPEED, MAX_STEPS
from sandbox.scene.description.fixed import MAX_LAYERS, MAX_ZONES
from sandbox.scene.description.world import COMMON, Settings
from sandbox.scene.validate.scene import MAX_SURFACES
from sandbox.trajectory import Trajectory
from sandbox.window.editor.edit_keys import HELP_GROUPS
from sandbox.window.input.bindings import control_help
from sandbox.window.ui.help import help_groups

SCENES = {
    "artillery": "artillery/duel",
    "curling": "games/curling",
    "landing": "games/landing",
    "pinball": "pinball/full",
}
"""A scene of each game."""

BALL = '[[ball]]\nname = "a"\nposition = [0, 2]\nradius = 0.5\n'
TRIALS = (
    f"[world]\ngravity = [0, -9.81]\n[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n{BALL}",
    "[world]\ngravity = [0, -9.81]\n[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
    "[[box]]\nposition = [0, 2]\nsize = [1, 1]\n",
    f'{BALL}[[joint]]\nkind = "rod"\nbetween = ["a"]\n',
)
"""Scenes of a ball over a plane, a box over a plane, a pendulum: a choice may be for one of them only."""

COMPANIONS: dict[str, dict[str, object]] = {
    "stiffness": {"response": "penalty"},
    "damping": {"response": "penalty"},
    "stretch": {"joints": "relaxation"},
    "sleep_time": {"sleeping": True},
    "idle_speed": {"sleeping": True},
}
"""Choices that a key needs beside it."""

VALUES: dict[str, object] = {
    "slop": 0.001, "bias": 0.01, "persistence": 1, "stiffness": 1e4, "damping": 0.5, "half_kick": True, "stretch": 0.1,
    "continuous": True, "sleeping": True, "sleep_time": 0.3, "idle_speed": 0.1, "workers": 2,
}  # fmt: skip
"""A value of each key that is no word."""

SQL = {str: "TEXT", int: "INTEGER", float: "REAL"}
"""Types of columns."""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def engines() -> str:
    """Return which demand each engine models."""
    rows = [
        [str(demand), *("yes" if demand in engine.capabilities else "–" for engine in ENGINES.values())]
        for demand in Demand
    ]
    return table(["demand", *(f"`{name}`" for name in ENGINES)], rows)


def solver_choices() -> str:
    """Return which engine accepts which choice of `[solver]`, found by asking each engine."""
    rows = []
    for key, choices in _choices().items():
        for choice in choices:
            accepted = [
                "yes" if _accepts(engine, {key: choice} | COMPANIONS.get(key, {})) else "–" for engine in ENGINES
            ]
            value = (
                str(choice).lower() if isinstance(choice, bool) else f'"{choice}"' if isinstance(choice, str) else "…"
            )
            rows.append([f"`{key} = {value}`" if value != "…" else f"`{key}`", *accepted])
    return table(["key", *(f"`{name}`" for name in ENGINES)], rows)


def _choices() -> dict[str, tuple[object, ...]]:
    """Return the keys of `[solver]` that not every engine has, and for each the values to try."""
    found: dict[str, tuple[object, ...]] = {}
    for key, hint in get_type_hints(Settings).items():
        words = [word for kind in get_args(hint) for word in get_args(kind) if isinstance(word, str)]
        if key in Settings.model_fields and key not in COMMON:
            found[key] = tuple(words) or (VALUES[key],)
    return found


def _accepts(engine: str, choice: dict[str, object]) -> bool:
    """Return whether an engine accepts a choice for one of the scenes that it may be for."""
    for text in TRIALS:
        scene = sandbox.loads(text)
        if not ENGINES[engine].missing(scene, scene.solver.replace(**choice)):
            return True
    return False


def causes() -> str:
    """Return the causes of the energy account."""
    return table(["cause", "energy changed by"], [[cause.value, cell(_cause_texts()[cause.name])] for cause in Cause])


def _cause_texts() -> dict[str, str]:
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(Cause))).body
    assert isinstance(definition, ast.ClassDef)
    found: dict[str, str] = {}
    for name, text in zip(definition.body, definition.body[1:], strict=False):
        match name, text:
            case ast.Assign(targets=[ast.Name(id=word)]), ast.Expr(value=ast.Constant(value=str(words))):
                found[word] = inspect.cleandoc(words)
    return found


def limits() -> str:
    """Return the environment variable, default, meaning and reason of each resource limit."""
    rows = [
        [f"`{limit.variable}`", limit.shown(limit.default), cell(limit.bounds), cell(limit.reason)] for limit in LIMITS
    ]
    return table(["variable", "default", "bounds", "reason for the default"], rows)


def metrics() -> str:
    """Return the metrics of a trade-off."""
    rows = [[f"`{metric.name}`", metric.unit or "–", cell(metric.about)] for metric in METRICS.values()]
    return table(["metric", "unit", "counts"], rows)


def fixed_limits() -> str:
    """Return the limits that no variable changes."""
    rows = [
        ("bodies of a scene", f"{MAX_BODIES:,}"),
        ("surfaces of a scene: different restitution, friction, falloff or kick", f"{MAX_SURFACES:,}"),
        ("zones of a scene", f"{MAX_ZONES:,}"),
        ("layers of a scene", f"{MAX_LAYERS:,}"),
        ("substeps of a run", f"{MAX_STEPS:.0e}"),
        ("coordinates at the start", f"{MAX_POSITION:.0e} m"),
        ("speeds at the start", f"{MAX_SPEED:.0e} m/s"),
        ("coordinates during a run; larger ones end it as `diverged`", f"{FARTHEST:.0e} m"),
        ("speeds during a run; larger ones end it as `diverged`", f"{FASTEST:.0e} m/s"),
        ("depth of a centre behind a plane at the start", f"{BACKING:,.0f} m"),
    ]
    return table(
        ["quantity", "at most"], [[what, bound.replace("e+0", "e").replace("e+", "e")] for what, bound in rows]
    )


def window_keys() -> str:
    """Return the keys of the window by group, as its help lists them."""
    parts = [f"### {group.title}\n\n{_keys(group.lines)}" for group in help_groups()]
    return "\n\n".join(parts)


def edit_keys() -> str:
    """Return the keys of the editor by group, as its help lists them."""
    parts = [f"### {group.title}: editing\n\n{_keys(group.lines)}" for group in HELP_GROUPS]
    return "\n\n".join(parts)


def cue_keys() -> str:
    """Return the keys at a billiard table."""
    return _keys(CUE_KEY_HELP)


def game_keys() -> str:
    """Return the keys of each game with rules, as its help lists them."""
    parts = []
    for name in sorted(games_with_rules()):
        rules = required_rules(sandbox.load(SCENES[name]))
        parts.append(f"### {name.capitalize()}\n\n{_keys(control_help(tuple(rules.controls)))}")
    return "\n\n".join(parts)


def _keys(lines: Sequence[tuple[str, str]]) -> str:
    return table(["key", "action"], [[f"`{keys}`", cell(about)] for keys, about in lines])


def store_columns() -> str:
    """Return the columns of the table `runs`."""
    hints, about = get_type_hints(StoredRun), _docstrings(StoredRun)
    rows = []
    for column in fields(StoredRun):
        kinds = get_args(hints[column.name]) or (hints[column.name],)
        (kind,) = (SQL[each] for each in kinds if each is not NoneType)
        null = "yes" if NoneType in kinds else "no"
        rows.append([f"`{column.name}`", kind, null, cell(about.get(column.name, ""))])
    return table(["column", "type", "may be null", "meaning"], rows)


def stored_arrays() -> str:
    """Return the arrays of a stored run."""
    about = _docstrings(Trajectory)
    rows = []
    for name, lengths in SHAPES.items():
        shape = f"({', '.join(map(str, lengths))}{',' if len(lengths) == 1 else ''})"
        kind = {"U": "text", "i8": "int64", "i": "integer"}[KINDS[name]] if name in KINDS else "float64"
        meaning = about[name].partition(") ")[2] if about[name].startswith("(") else "a JSON object: " + about[name]
        rows.append([f"`{name}`", f"`{shape}`", kind, "yes" if name in OPTIONAL else "", cell(meaning)])
    return table(["array", "shape", "type", "optional", "unit and meaning"], rows)


def _docstrings(kind: type) -> dict[str, str]:
    """Return what is written below the fields of a dataclass."""
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(definition, ast.ClassDef)
    found: dict[str, str] = {}
    for field, text in zip(definition.body, definition.body[1:], strict=False):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                found[name] = inspect.cleandoc(words)
    return found


GENERATORS: dict[str, Callable[..., str]] = {
    "scene": scene_tables,
    "scene-overview": scene_overview,
    "scene-top": top_keys,
    "model": model_fields,
    "classes": classes,
    "input-script": input_script,
    "engines": engines,
    "solver-choices": solver_choices,
    "causes": causes,
    "metrics": metrics,
    "limits": limits,
    "fixed-limits": fixed_limits,
    "window-keys": window_keys,
    "edit-keys": edit_keys,
    "cue-keys": cue_keys,
    "game-keys": game_keys,
    "store-columns": store_columns,
    "stored-arrays": stored_arrays,
    "environments": environments,
    "classics": classics,
    "classic": classic,
    "environment": environment,
    "environment-arguments": arguments,
    "gallery": gallery,
    "replay": replay,
}
