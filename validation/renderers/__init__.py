"""The BSDFs of a renderer against explicit surfaces."""
