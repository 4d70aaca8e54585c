"""Parts that engines share: kernels, body state, contacts, actions, zones, motors and energy."""
