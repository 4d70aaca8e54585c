"""Driving: how drives move their bodies while these meet nothing, whichever engine runs them."""
