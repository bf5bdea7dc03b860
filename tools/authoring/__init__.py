"""Scripts that generate the textures and meshes in `models/`. The simulator does not use them."""
