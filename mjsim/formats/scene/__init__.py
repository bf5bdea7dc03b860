"""Scenes as returned by readers, and readers for mesh files."""
