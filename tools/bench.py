"""Run the benchmarks of `tools/benchmarks`: `python tools/bench.py [NAME…] [--json] [--repeats N]`."""

import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])  # the root, so that `tools` is a package, not this folder
    runpy.run_module("tools.benchmarks", run_name="__main__", alter_sys=True)
