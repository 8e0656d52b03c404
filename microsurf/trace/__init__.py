"""What an explicit surface does to light: beam, rays, facet events, detector."""

from .measurement import measure

__all__ = ["measure"]
