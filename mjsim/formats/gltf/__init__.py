"""Houses and scenes as glTF, with WebP textures and JSON."""
