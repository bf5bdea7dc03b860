"""Determine which payments are due to participants, and send them to the recruitment platform."""
