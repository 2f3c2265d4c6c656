"""Reports of a run: a JSON document, a self-contained HTML page, and the power surface to look at."""
