"""A measured BRDF fitted with microfacets."""
