"""A user BRDF in a model's place."""
