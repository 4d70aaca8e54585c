"""Batches: many runs, stored once each."""
