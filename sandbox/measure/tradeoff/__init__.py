"""The trade of speed for accuracy: measured over engines and settings."""
