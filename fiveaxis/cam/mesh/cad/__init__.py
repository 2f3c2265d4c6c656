"""CAD files with exact surfaces: STEP and IGES."""
