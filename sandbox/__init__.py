"""A 2D game physics sandbox: a scene is a file, the engine is a choice, the price of every choice is measured."""
