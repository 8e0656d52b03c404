"""Explicit Student-t microsurfaces, ray-traced and compared with microfacet theory."""
