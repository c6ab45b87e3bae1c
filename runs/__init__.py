"""Scenes, the command line and the pictures."""
