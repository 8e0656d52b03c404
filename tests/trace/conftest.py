"""Lets the tests of the tracer import `small`, their scenes."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
