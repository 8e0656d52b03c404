"""The stability map: how many digits are right, and where meshes and traces end."""

from .map import Stability, survey

__all__ = ["Stability", "survey"]
