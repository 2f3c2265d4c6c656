"""Meshes of parts and bodies: files, distances, smooth normals, exact surfaces of CAD files."""
