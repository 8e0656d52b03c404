"""Results, measured or predicted alike: dataset, albedos, peaks, uncertainty."""
