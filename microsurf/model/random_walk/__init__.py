"""All orders by random walks among Smith's facets or in V-cavities."""
