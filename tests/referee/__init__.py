"""LinuxCNC as a referee: its simulated machine runs what is written for it."""
