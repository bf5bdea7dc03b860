"""Scripts that generate the textures and meshes of `models/`. The simulator does not use them."""
