"""Shows many homes: `mjsim house gallery`."""
