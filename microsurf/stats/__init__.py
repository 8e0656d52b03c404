"""Statistics that know nothing of light: tests, variance components, convergence orders."""
