"""Readers of instruments' files, one a file; `surface.formats` lists them."""
