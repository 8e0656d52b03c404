"""Lets the tests of the analysis import each other's experiments."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
