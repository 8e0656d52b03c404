"""What a scene's difference between measurement and prediction is made of."""
