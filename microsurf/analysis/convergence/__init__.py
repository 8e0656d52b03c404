"""How a scene's figures move with cells, tile and rays."""
