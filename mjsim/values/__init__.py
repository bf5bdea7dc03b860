"""Immutable data types and exceptions that all packages share."""
