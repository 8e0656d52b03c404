"""STD of a measured surface: how well it fits, at which scale, and what limits it."""
