"""Visibility of objects and receptacles for a person, and fill heights of receptacles."""
