"""Mitsuba as a second tracer of the same surfaces."""
