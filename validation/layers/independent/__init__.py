"""What two layers that know nothing of each other send back: traced, and by three theories."""
