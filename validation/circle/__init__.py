"""From a measured surface to a BRDF, and from a measured BRDF to a surface and back."""
