"""Masks: searches and refinement that avoid refused postures with as few queries as possible."""
