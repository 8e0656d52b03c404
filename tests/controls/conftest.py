"""Lets these tests import the scripts and peers of validation/, as the scripts do themselves."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "validation"))
