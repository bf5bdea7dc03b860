"""Import objects from mesh files into the catalogue of a house."""
