"""Where one interfaced-Lambertian facet stands for two explicit layers."""
