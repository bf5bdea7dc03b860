"""Readers for glTF files, and writers that export houses and scenes as glTF with WebP textures."""
