"""What several benchmarks and their tests use."""
