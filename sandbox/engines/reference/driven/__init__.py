"""Driven: bodies that drives hold, on the hand-written solvers."""
