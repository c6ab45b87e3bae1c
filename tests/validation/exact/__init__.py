"""The closed forms, each against a second way to the same answer."""
