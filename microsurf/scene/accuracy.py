"""How much work is done, or how small the error must be, and which engine traces."""

from dataclasses import dataclass

from ..errors import InputError
from . import engines, validators

DEFAULT_PATHS = 1_000_000
MOST_PATHS = 10**12
LEAST_ERROR = 1e-6


@dataclass(frozen=True)
class Accuracy:
    """How much work: paths for each angle and realisation, or the error to reach.

    ``standard_error`` is that of albedos, ``lobe_error`` that of lobes relative to
    themselves (see `precision`), by default the same number. ``engine`` traces, one of
    `engines.ENGINES`; "auto" is kept as None.
    """

    paths: int = DEFAULT_PATHS
    standard_error: float | None = None
    lobe_error: float | None = None
    engine: str | None = None

    def __post_init__(self) -> None:
        if self.engine is not None:
            object.__setattr__(self, "engine", engines.checked(self.engine))
        validators.integer("accuracy.paths", self.paths, 1, MOST_PATHS)
        for name in ("standard_error", "lobe_error"):
            target = getattr(self, name)
            if target is not None:
                number = validators.number(f"accuracy.{name}", target)
                validators.require(
                    LEAST_ERROR <= number <= 1, f"accuracy.{name}", target, "1e-6 … 1"
                )
                object.__setattr__(self, name, number)
        if self.lobe_error is not None and self.standard_error is None:
            raise InputError(
                f"accuracy.lobe_error = {self.lobe_error}: goes with a standard_error; give both"
            )
        if self.standard_error is not None and self.paths != DEFAULT_PATHS:
            raise InputError(
                f"accuracy.paths = {self.paths} and standard_error = {self.standard_error}: "
                "give one of both; paths are then as many as the error takes"
            )

    def with_paths(self, paths: int) -> "Accuracy":
        """So many paths instead, by the same engine."""
        return Accuracy(paths, engine=self.engine)
