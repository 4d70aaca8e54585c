"""State hashes of the sample scenes after a stated time on each engine, with what they depend on.

    python -m tests.laws.state_hashes [ENGINE…]           # compute and compare; compiles the kernels of these engines
    python -m tests.laws.state_hashes --write             # after a change that is meant to change results

`NUMBA_DISABLE_JIT=1` computes them without compiled kernels, which must not change a bit.
"""

import argparse
import json
import platform
import sys
from functools import cache
from pathlib import Path
from typing import Any

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import ENGINES, able, start
from sandbox.provenance import machine, versions
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from tests.samples import SAMPLE_SCENES

TABLE = Path(__file__).with_name("state_hashes.json")

TIME = 1.0
"""s of simulated time"""

LIBRARY = {"pymunk": "pymunk", "box2d": "pyb2d3", "exact": "numba", "reference": "numba"}
"""What computes the states of an engine, or compiles what does."""


def state_hash(name: str, engine: str) -> str:
    """Return the hash of a sample scene's state at `TIME`, or the name of the exception that ended it."""
    scene = load(find(name))
    simulation = start(scene, engine)
    simulation.contacts()  # as a run has them
    try:
        for _ in range(round(TIME / scene.solver.dt)):
            simulation.step()
    except (Divergence, Exhaustion) as end:
        return type(end).__name__
    return simulation.state_hash()


def cells(engines: tuple[str, ...] = tuple(ENGINES)) -> list[tuple[str, str]]:
    """Return each sample scene with each engine that models it."""
    return [(name, engine) for name in SAMPLE_SCENES for engine in able(load(find(name))) if engine in engines]


def conditions() -> dict[str, str]:
    """Return what states depend on besides the sources: versions and platform."""
    found = {key: value for key, value in versions().items() if key not in ("sandbox", "python")}
    libc = " ".join(platform.libc_ver())
    return found | {"platform": f"{platform.system()} {platform.machine()} {libc}", "processor": str(machine()["cpu"])}


@cache
def recorded() -> dict[str, Any]:
    """Return the table."""
    found: dict[str, Any] = json.loads(TABLE.read_text(encoding="utf-8"))
    return found


def difference(engine: str) -> str | None:
    """Return which condition of an engine's states is another one than that of the table; None if all are the same."""
    now, then = conditions(), recorded()["conditions"]
    for key, word in ((LIBRARY[engine], "library or compiler"), ("numpy", "library"), ("platform", "platform")):
        if now.get(key) != then.get(key):
            return f"another {word}: {key} {now.get(key)}, in the table {then.get(key)}"
    if now["processor"] != then["processor"]:
        return f"another processor: {now['processor']}, in the table {then['processor']}"
    return None


def main() -> int:
    """Compute the hashes; compare them with the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("engines", nargs="*", default=list(ENGINES), help="engines, all by default")
    parser.add_argument("--write", action="store_true", help="write the table")
    given = parser.parse_args()
    found = {f"{name} {engine}": state_hash(name, engine) for name, engine in cells(tuple(given.engines))}
    if given.write:
        table = {"time": TIME, "conditions": conditions(), "hashes": found}
        TABLE.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
        return 0
    others = [key for key, value in found.items() if recorded()["hashes"].get(key) != value]
    print(f"{len(found) - len(others)} of {len(found)} states are those of the table", *others, sep="\n  ")
    for engine in given.engines:
        if others and (reason := difference(engine)):
            print(f"{engine}: {reason}")
    return 1 if others else 0


if __name__ == "__main__":
    sys.exit(main())
