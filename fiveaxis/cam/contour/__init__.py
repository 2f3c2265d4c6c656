"""Finishing passes of a ball end mill on a mesh, and contacts of programmed paths."""
