"""Oracles: independent programs whose results the tests compare with."""
