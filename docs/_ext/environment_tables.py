"""Tables of the Gymnasium environments, from the environments: actions, observations and arguments of each."""

import math
import re
from collections.abc import Iterator, Sequence
from itertools import groupby

import gymnasium
from gymnasium import spaces

from sandbox.game_names import game_specs
from sandbox.games.contract import ObservationRange
from sandbox.gym import CLASSICS, STATES, SandboxEnv

ELLIPSIS = "…"

Row = tuple[str, str, ObservationRange]
"""Indices, name and range of observed numbers."""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def environments() -> str:
    """Return a table of all environments."""
    rows = []
    for spec in game_specs():
        for each in spec.environments:
            env = _make(each.name)
            rows.append(
                [
                    f"`{each.id}`",
                    _space(env),
                    f"{len(env.observed)}",
                    f"{env.every * env.scene.solver.dt:g} s",
                    f"{env.scene.world.duration:,g} s",
                    f"`{env.engine}`",
                ]
            )
    return table(["id", "action space", "observed numbers", "time per action", "longest episode", "engine"], rows)


def environment(name: str) -> str:
    """Return action space, observation space and arguments of an environment, by its name."""
    env = _make(name)
    parts = [
        f"Action space: `{_space(env)}`.",
        table(["num", "control", "meaning"], [*_action_rows(env)]),
        f"Observation space: `Box` of {len(env.observed)} numbers, float32.",
        table(["num", "observation", "min", "max", "unit"], [*_observation_rows(env)]),
        *_bodies(env),
    ]
    return "\n\n".join(parts)


def classics() -> str:
    """Return a table of the environments that repeat those of Gymnasium."""
    rows = []
    for name, (_, _, steps, threshold) in CLASSICS.items():
        env = gymnasium.make(f"sandbox/{name}")
        (count,) = env.observation_space.shape or ()
        rows.append([f"`sandbox/{name}`", f"{env.action_space}", f"{count}", f"{steps:,}", f"{threshold:g}"])
    return table(["id", "action space", "observed numbers", "longest episode, steps", "return of a solution"], rows)


def classic(name: str) -> str:
    """Return the numbers of an observation of one of these environments, by its name."""
    env = gymnasium.make(f"sandbox/{name}")
    assert isinstance(env.observation_space, spaces.Box)
    bounds = zip(env.observation_space.low.tolist(), env.observation_space.high.tolist(), strict=True)
    rows = [
        [f"{k}", each, _bound(low), _bound(high)]
        for k, (each, (low, high)) in enumerate(zip(env.get_wrapper_attr("observed"), bounds, strict=True))
    ]
    return table(["num", "observation", "min", "max"], rows)


def arguments(name: str) -> str:
    """Return the defaults of the arguments of an environment that differ from those of `SandboxEnv`."""
    given = gymnasium.spec(_id(name)).kwargs
    return f"Defaults of `{_id(name)}`: {', '.join(f'`{key}={value!r}`' for key, value in given.items())}."


def _id(name: str) -> str:
    return next(each.id for spec in game_specs() for each in spec.environments if each.name == name)


def _make(name: str) -> SandboxEnv:
    env = gymnasium.make(_id(name)).unwrapped
    assert isinstance(env, SandboxEnv)
    return env


def _space(env: SandboxEnv) -> str:
    """Return an action space as Gymnasium prints it, without the repetition of `MultiDiscrete`."""
    if isinstance(env.action_space, spaces.MultiDiscrete):
        return f"MultiDiscrete([2] * {len(env.controls)})"
    return f"{env.action_space}"


def _action_rows(env: SandboxEnv) -> Iterator[list[str]]:
    for k, control in enumerate(env.controls):
        value = "" if control.analogue or not env.analogue else "; on above 0.5"
        released = f"; released up to {control.dead_zone:g}" if control.dead_zone else ""
        yield [f"{k}", control.name, f"{control.about}{value}{released}"]


def _observation_rows(env: SandboxEnv) -> Iterator[list[str]]:
    """Yield a row for each number; equal bodies, and numbers that differ only in their number, share their rows."""
    for number, name, each in (*_body_rows(env), *_rules_rows(env)):
        yield [number, name, _bound(each.low), _bound(each.high), each.unit]


def _groups(env: SandboxEnv) -> Iterator[tuple[int, list[str]]]:
    """Yield index of the first number, and names, of consecutive observed bodies with equal ranges."""
    names = [env.scene.bodies.names[index] for index in env.observed_bodies.tolist()]
    size = len(STATES)
    for _, members in groupby(range(len(names)), key=lambda k: env.observed_ranges[size * k : size * (k + 1)]):
        indices = list(members)
        yield size * indices[0], [names[k] for k in indices]


def _body_rows(env: SandboxEnv) -> Iterator[Row]:
    for first, names in _groups(env):
        for k, state in enumerate(STATES, first):
            if len(names) == 1:
                yield f"{k}", env.observed[k], env.observed_ranges[k]
            else:
                yield f"{k} + {len(STATES)}k", f"{names[0]} {ELLIPSIS} {names[-1]}: {state}", env.observed_ranges[k]


def _rules_rows(env: SandboxEnv) -> Iterator[Row]:
    first = len(STATES) * len(env.observed_bodies)
    rest = [(k, env.observed[k], env.observed_ranges[k]) for k in range(first, len(env.observed))]
    for _, members in groupby(rest, key=lambda row: (re.sub(r"\d+", "#", row[1]), row[2])):
        rows = list(members)
        (begin, name, its), (end, last, _) = rows[0], rows[-1]
        yield (f"{begin}", name, its) if begin == end else (f"{begin}–{end}", f"{name} {ELLIPSIS} {last}", its)


def _bodies(env: SandboxEnv) -> list[str]:
    """Return a line on the numbers of equal bodies, if some share rows."""
    shared = [names for _, names in _groups(env) if len(names) > 1]
    lists = "; ".join(f"k = 0 … {len(names) - 1} for {', '.join(f'`{name}`' for name in names)}" for names in shared)
    return [f"Here {lists}."] if shared else []


def _bound(value: float) -> str:
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    return f"{value:.4g}".replace("-", "−")
