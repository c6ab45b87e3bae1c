"""The catalogue: one function a case."""
