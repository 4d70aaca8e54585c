"""Mutation testing: small changes of the core that tests should notice, and which tests notice them."""
