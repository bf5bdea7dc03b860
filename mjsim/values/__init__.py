"""Frozen values that packages exchange, and the errors of `mjsim`."""
