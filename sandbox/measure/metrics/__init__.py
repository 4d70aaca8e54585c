"""Quantities of a recorded run: energy, clearance, contacts, conservation laws, errors against another run."""
