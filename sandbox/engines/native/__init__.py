"""The native engine: a thin adapter onto pymunk spaces, and the only place that imports pymunk."""
