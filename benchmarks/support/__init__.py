"""Code that is shared by the benchmarks and their tests."""
