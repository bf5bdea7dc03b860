"""Houses as files that other programs draw: GLB (binary glTF 2.0), WebP and JSON."""
