"""Surfaces that bodies are kept off, and where motions meet them."""
