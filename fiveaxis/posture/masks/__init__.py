"""Postures that a mask refuses: asked as seldom as possible, and kept off."""
