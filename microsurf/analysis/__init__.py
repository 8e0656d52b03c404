"""Measurements against predictions: verdicts, error budgets, trade-offs, convergence."""
