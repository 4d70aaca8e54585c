"""Pictures of README and documentation, by the part of the program that draws them."""
