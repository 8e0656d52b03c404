"""Results and measurements as labelled data."""
