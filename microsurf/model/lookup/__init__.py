"""What renderers look up: tables of what takes an integral or a walk for each pair."""
