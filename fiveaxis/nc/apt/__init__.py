"""APT and CLDATA: statements of CAM systems as toolpaths."""
