"""How often verdicts err: false alarms, and defects that must be caught."""
