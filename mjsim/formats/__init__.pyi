from .gltf.export import export_scene

__all__ = ["export_scene"]
