"""The window: scenes to play with, and stored runs to look at."""
