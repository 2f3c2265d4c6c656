"""Start points of closed passes."""
