"""Objects of one's own: a mesh file becomes an object model that is sampled, carried and placed (docs/import.md)."""
