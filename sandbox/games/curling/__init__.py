"""Curling: two teams slide stones to the middle of a house, in ends of sixteen; a skip who aims by the closed form."""
