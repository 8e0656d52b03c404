"""Figures of the README and the papers' parameters."""
