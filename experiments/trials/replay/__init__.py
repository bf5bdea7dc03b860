"""Simulates recorded runs again, compares every control step, and films them in other views."""
