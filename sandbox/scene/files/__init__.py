"""Scene files: reading, overrides, presets, messages for faults, the schema, and the shipped scenes."""
