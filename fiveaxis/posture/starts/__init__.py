"""Closed passes that may begin elsewhere."""
