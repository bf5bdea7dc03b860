"""Export of houses and scenes as glTF with WebP textures, and readers of glTF files."""
