"""Global search: from exact posture to exact posture, everywhere or near a path."""
