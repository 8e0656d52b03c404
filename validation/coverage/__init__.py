"""How often intervals of fits hold the truth, of surfaces and BRDFs made up like measured ones."""
