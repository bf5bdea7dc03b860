"""Code shared by benchmarks and their tests."""
