"""Pictures and animations of records."""
