"""Benchmarks: times and rates as ratios to a peer in the same run. `python tools/bench.py` runs them."""
