"""Bodies around the tool, and checks whether any two of them come too near."""
