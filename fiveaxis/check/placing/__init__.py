"""Where the part can stand so that a machine reaches a path, clear of what is around it."""
