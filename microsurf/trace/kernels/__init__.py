"""The compiled loops of the tracer."""
