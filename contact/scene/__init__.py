"""Scenes: their schema, and what is built from them."""
