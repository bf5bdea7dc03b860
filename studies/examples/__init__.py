"""Worked examples for people who train agents."""
