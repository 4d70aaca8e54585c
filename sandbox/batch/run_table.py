"""Run table: one row per stored run, with the values by which the runs differ and the measured figures.

with sandbox.Store("study") as store:
rows = sandbox.run_table(store)          # dicts; pandas.DataFrame(rows) is a table
"""

import json
import zipfile
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sandbox.batch.store import Store
from sandbox.batch.stored_run import StoredRun
from sandbox.jsonable import JsonObject

FIRST = ("id", "title", "engine", "seed", "status", "reason")
"""First columns, before those by which the runs differ."""
LAST = (
    "steps", "seconds", "energy_start", "energy_end", "contacts", "missed_contacts", "score", "state_hash",
)  # fmt: skip
"""Last columns: see the columns of a run store."""
ELSEWHERE = ("title", "about", "solver", "play")
"""Tables of a scene without columns: they do not distinguish runs, or have columns of their own."""


def run_table(store: Store) -> list[JsonObject]:
    """Return one row per stored run, in the order of adding. All rows have the same keys.

    Between `FIRST` and `LAST` there is a column for each value by which runs of one title differ, named by its path as
    in `--set`: `solver.dt`, `world.gravity`, `ball.cue.restitution`. A run without that value has None. Lists are JSON
    text.

    Args:
        store: the folder. A file that cannot be read is reported by its notice; its row has no values of the scene.

    Raises:
        StoreError: the database cannot be read.
    """
    runs = store.rows()
    values, hashes = [], []
    for run in runs:
        info = _info(store, run)
        scene = {key: value for key, value in info.get("scene", {}).items() if key not in ELSEWHERE}
        scene.get("world", {}).pop("seed", None)  # has its own column
        values.append(dict(_flat({**scene, "solver": json.loads(run.settings)})))
        hashes.append(info.get("state_hash"))
    differing = _differing([run.scene_title for run in runs], values)
    return [
        {
            **{key: getattr(run, "scene_title" if key == "title" else key) for key in FIRST},
            **{path: _cell(own.get(path)) for path in differing},
            **{key: state_hash if key == "state_hash" else getattr(run, key) for key in LAST},
        }
        for run, own, state_hash in zip(runs, values, hashes, strict=True)
    ]


def _info(store: Store, run: StoredRun) -> dict[str, Any]:
    """Return the info of a run from its file, without reading the arrays."""
    path = store.file(run)
    if path is None:
        return {}
    try:
        with np.load(path, allow_pickle=False) as file:
            info = json.loads(file["info"].item())
        if isinstance(info, dict):
            return info
        fault = "its info is not a JSON object"
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        fault = str(error)
    store.notice(f"{store.file(run)}: cannot be read, so its row has no values of the scene: {fault}")
    return {}


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and value of every leaf. Elements are addressed by name, or by number without one."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and all(isinstance(each, Mapping) for each in value):
        for k, inner in enumerate(value):
            yield from _flat({key: v for key, v in inner.items() if key != "name"}, f"{path}.{inner.get('name', k)}")
    else:
        yield path, value


def _differing(titles: list[str], values: list[dict[str, Any]]) -> list[str]:
    """Return the paths whose values differ between runs of one title, in the order of their first occurrence."""
    groups: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
    for title, own in zip(titles, values, strict=True):
        groups[title].append(own)
    found: dict[str, None] = {}
    for group in groups.values():
        for path in dict.fromkeys(path for own in group for path in own):
            if any(own.get(path) != group[0].get(path) for own in group):
                found[path] = None
    return list(found)


def _cell(value: Any) -> Any:
    return value if value is None or isinstance(value, str | int | float | bool) else json.dumps(value)
