"""Maintainers' tools: models, pictures and generated pages of the documentation. Not part of the wheel."""
