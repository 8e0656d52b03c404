"""Error against cost over all scenes, and whether recommendations hold."""
