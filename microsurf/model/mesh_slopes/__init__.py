"""The models on the slopes that a mesh has instead of those of the distribution."""
