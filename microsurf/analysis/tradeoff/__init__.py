"""Error against cost of every method, and which one to take."""
