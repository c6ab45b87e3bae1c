"""Closed-form solutions; they share no code with what they judge."""
