"""The atlas: how much the albedo depends on the structure of a surface."""
