"""A BRDF of the user's own in a model's place."""
