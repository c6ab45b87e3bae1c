"""Contact between the surfaces of two bodies."""
