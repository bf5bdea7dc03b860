"""Frozen values that cross the borders of packages, and errors."""
