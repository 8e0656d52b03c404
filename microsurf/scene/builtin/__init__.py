"""The scenes that come with microsurf, as TOML files beside this one."""

from importlib import resources
from pathlib import Path


def built_in_scenes() -> list[Path]:
    """Scene files that come with microsurf, in the order of their names."""
    return sorted(Path(str(resources.files(__name__))).glob("*.toml"))
