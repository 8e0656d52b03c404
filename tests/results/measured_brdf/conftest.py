"""Lets these tests import `tensor_writer`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
