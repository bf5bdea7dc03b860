"""Helpers used by all packages: files, compiled kernels, and the Python environment."""
