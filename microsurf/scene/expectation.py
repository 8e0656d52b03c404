"""What a scene must show: a verdict for each quantity, and why."""

from dataclasses import dataclass

from . import validators

QUANTITIES = ("specular", "body", "total")
VERDICTS = ("holds", "departs", "undecided")
ANY_VERDICT = ("|".join(VERDICTS),)


@dataclass(frozen=True)
class Expectation:
    """Verdict a scene must show for one quantity, for each θ_i in order, and why.

    ``margin`` is the relative difference up to which the theory counts as holding.
    ``verdict`` names one verdict for all angles or one for each; ``"a|b"`` allows both.
    """

    verdict: tuple[str, ...] = ANY_VERDICT
    margin: float = 0.05
    why: str = ""

    def __post_init__(self) -> None:
        given = self.verdict
        verdict = tuple(given) if isinstance(given, list | tuple) else (given,)
        object.__setattr__(self, "verdict", verdict)
        for entry in verdict:
            for word in str(entry).split("|"):
                validators.choice("expect.verdict", word, VERDICTS)
        validators.require(isinstance(self.why, str), "expect.why", self.why, "a text")
        object.__setattr__(self, "margin", validators.number("expect.margin", self.margin))
        validators.require(0 < self.margin < 1, "expect.margin", self.margin, "between 0 and 1")
