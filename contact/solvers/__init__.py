"""Contact methods: one file each, one signature."""
