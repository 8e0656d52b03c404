"""Every model as one entry: what it computes, what it is called, cited and drawn like.

A new masking function is one file with its G2 and one entry in MODELS; so is a walk with
its kernels. `predict`, `walk`, `Brdf`, `validate`, the command line, the figures and the
citations take what they know of models from here.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ..physics import smith, smith_fit
from ..scene import Citation
from .random_walk.layered_kernels import layered_next_event, layered_walk
from .random_walk.smith_kernels import smith_next_event, smith_walk
from .random_walk.vcavity_kernels import mirrors, vcavity_next_event, vcavity_walk
from .single_scattering.body_closed_form import APPROXIMATE
from .single_scattering.facets import SMITH, Masking

Line = str | tuple[int, tuple[float, ...]]


@dataclass(frozen=True)
class Walk:
    """Compiled functions of a random walk, of all orders.

    ``simulate`` walks paths to their exits; ``next_event`` estimates single pairs of
    directions, see `random_walk.evaluate`. Where chains of mirrors alone have a closed form,
    ``mirrors`` adds them and ``next_event`` leaves them out.
    """

    simulate: Callable[..., Any]
    next_event: Callable[..., Any]
    mirrors: Callable[..., Any] | None = None


@dataclass(frozen=True)
class Model:
    """One entry.

    Attributes
    ----------
    key : str
        Its name in `predict`, on the command line and in results.
    label : str
        Its name in figures, without its orders.
    what : str
        What it computes, in one line, for the help.
    citations : tuple of str or Citation
        What it rests on: keys of `report.references`, or works that are not in that list.
    line, marker, colour : str
        matplotlib's; colours by the names of `report.figures.style.PALETTE`. Curves of the same
        orders differ in their lines.
    masking : Masking or None
        How the facets of order 1 hide one another; None for walks and the flat interface.
    walk : Walk or None
        Its kernels, if it is of all orders.
    layered : bool
        Whether it is of two layers, and of scenes with [layers] alone.
    compared : bool
        Whether `validate` predicts every scene by it. Verdicts are about the first such entry of
        order 1, and the total about the first of all orders.

    """

    key: str
    label: str
    what: str
    citations: tuple[str | Citation, ...]
    line: Line
    marker: str
    colour: str
    masking: Masking | None = None
    walk: Walk | None = None
    layered: bool = False
    compared: bool = False

    @property
    def orders(self) -> str:
        """Which orders it is of: "1" or "all"."""
        return "1" if self.walk is None else "all"

    @property
    def flat(self) -> bool:
        """Whether roughness is left out."""
        return self.masking is None and self.walk is None

    @property
    def quadrature(self) -> bool:
        """Whether its body term takes an integral for each pair of directions: it is slow."""
        return self.masking is not None and self.masking.body is None


MODELS: dict[str, Model] = {
    entry.key: entry
    for entry in (
        Model(
            "flat", "flat IL", "one flat interface, roughness left out",
            (), "-", "v", "grey",
        ),
        Model(
            "approximate", "closed approximation", "smith with a closed form of its body term",
            ("meneveaux2018",), "-.", "^", "orange",
            APPROXIMATE,
        ),
        Model(
            "smith", "Smith", "Smith's height-correlated G2",
            ("smith1967", "heitz2014"), "-", "s", "blue", SMITH, compared=True,
        ),
        Model(
            "smith-separable", "Smith, separable", "Smith's G1 G1",
            ("smith1967", "heitz2014"), "--", "p", "blue", Masking(smith.g2_separable),
        ),
        Model(
            "vcavity", "V-cavity", "V-cavities of Torrance and Sparrow",
            ("torrance1967",), ":", "D", "purple", Masking(None), compared=True,
        ),
        Model(
            "smith-fit", "Smith, published fit of Λ", "smith with Λ by the published fit",
            ("smith1967", "heitz2014", "ribardiere2017"), (0, (5, 1)), "P", "blue",
            Masking(smith_fit.g2_height_correlated),
        ),
        Model(
            "smith-separable-fit", "Smith, separable, fit of Λ",
            "smith-separable with Λ by the published fit",
            ("smith1967", "heitz2014", "ribardiere2017"), (0, (3, 1, 1, 1)), "X", "blue",
            Masking(smith_fit.g2_separable),
        ),
        Model(
            "smith-walk", "Smith walk", "a random walk among facets of independent heights",
            ("smith1967", "heitz2014", "heitz2016", "lam2015"), "-", "<", "vermilion",
            walk=Walk(smith_walk, smith_next_event), compared=True,
        ),
        Model(
            "vcavity-walk", "V-cavity walk", "a random walk between both facets of a V-cavity",
            ("torrance1967", "lam2015"), "--", ">", "purple",
            walk=Walk(vcavity_walk, vcavity_next_event, mirrors),
        ),
        Model(
            "layered-walk", "layered walk",
            "a random walk in two layers that know nothing of each other, of scenes with [layers]",
            ("smith1967", "heitz2014", "heitz2016", "guo2018"), "-.", "d", "green",
            walk=Walk(layered_walk, layered_next_event), layered=True,
        ),
    )
}  # fmt: skip
"""In the order of help and figures."""


def order_one() -> tuple[str, ...]:
    """Keys of the models of order 1 of one surface."""
    return tuple(key for key, entry in MODELS.items() if entry.walk is None)


def all_orders() -> tuple[str, ...]:
    """Keys of the models of all orders of one surface: random walks."""
    return tuple(
        key for key, entry in MODELS.items() if entry.walk is not None and not entry.layered
    )


def of_layers() -> tuple[str, ...]:
    """Keys of the models of two layers."""
    return tuple(key for key, entry in MODELS.items() if entry.layered)


def compared(keys: Iterable[str]) -> tuple[str, ...]:
    """Those of some keys that `validate` predicts every scene by."""
    return tuple(key for key in keys if MODELS[key].compared)


def entry_of(key: str, among: Iterable[str], argument: str = "model") -> Model:
    """Look up an entry that must be one of ``among``; ``argument`` is what the caller names it.

    Raises
    ------
    InputError
        If it is none of them.

    """
    among = tuple(among)
    if key not in among:
        raise InputError(f"{argument} = {key!r}: must be one of {', '.join(among)}")
    return MODELS[key]


def walk_of(key: str, argument: str = "kind") -> Walk:
    """Kernels of a model of all orders, of one surface or of two layers.

    Raises
    ------
    InputError
        If the key is none of one.

    """
    result = entry_of(key, (*all_orders(), *of_layers()), argument).walk
    assert result is not None  # noqa: S101 - by all_orders; for the type checker
    return result
