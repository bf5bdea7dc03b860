"""The scene that readers return, and readers of mesh files."""
