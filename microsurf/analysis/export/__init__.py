"""Materials for other programs, and how far a renderer's reading of them is from the source."""
