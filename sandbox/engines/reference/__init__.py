"""The reference engine: fixed step, written by hand, each of its choices a table of interchangeable functions."""
