"""Maintenance tools for models, pictures and generated documentation. They are not in the wheel."""
