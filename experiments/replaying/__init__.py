"""Simulating recorded runs again: reading them, comparing every step, filming them in other views."""
