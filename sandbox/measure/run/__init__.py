"""Headless runs: the step loop, the recorder, replays, played games."""
