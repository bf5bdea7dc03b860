"""Determine which objects and receptacles a person can see, and how full the receptacles are."""
