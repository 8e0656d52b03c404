"""The command line: one command a file; the only place that prints."""

from .entry import main

__all__ = ["main"]
