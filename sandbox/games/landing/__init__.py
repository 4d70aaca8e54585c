"""Landing: a lunar lander."""
