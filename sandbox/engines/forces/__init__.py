"""The laws of the external forces, one module each, which every engine, ledger and forecast evaluates."""
