"""billiards: playing at a table in the window: cue, aim, turns; no pygame, so that it can be tried without."""
