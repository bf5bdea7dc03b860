"""Immutable values shared by all packages, and the exceptions of `mjsim`."""
