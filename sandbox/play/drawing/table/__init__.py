"""table: how a billiard table, its balls and a cue are drawn."""
