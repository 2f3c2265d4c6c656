"""Writing programs: tables of controls, and motions as their blocks."""
