"""Parametric furniture, with one function per furniture type that creates a random piece."""
