"""The scene that readers return: pieces with surfaces, rooms and bins, and how mesh files become pieces."""
