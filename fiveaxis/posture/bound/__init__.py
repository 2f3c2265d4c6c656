"""What no posture can avoid: a certified lower bound."""
