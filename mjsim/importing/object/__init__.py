"""Import of objects: a mesh file becomes an object of a house's catalogue."""
