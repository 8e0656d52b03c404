"""The explorer: one page that draws lobes, traced points and a surface, and asks no server."""
