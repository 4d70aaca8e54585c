"""Parts of both event-driven simulations: state arrays, roots, contact log, body store and base class."""
