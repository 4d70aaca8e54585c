"""Development tools: benchmarks, oracles, calibration, pictures of the documentation, and the fuzzer."""
