"""Speed and memory, beside Mitsuba's."""
