"""Games that use pymunk, run again with recorded inputs and other settings of the physics."""
