"""Writing programs: tables of controls, and what turns a motion into their blocks."""
