"""Utilities for files, compiled kernels and the Python environment."""
