from .gltf.export import export_scene as export_scene
