"""Pictures of README and documentation, in modules by the part of the program that draws them."""
