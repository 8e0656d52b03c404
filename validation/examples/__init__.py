"""User BRDFs, as one writes them."""
