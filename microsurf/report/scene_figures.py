"""The pictures that every scene has, and the one of all scenes, with their captions."""

from collections.abc import Sequence

from ..analysis.validation import Validation
from ..model import MODELS
from .figures import albedo_by_order, lobes, overview, surface, verdicts
from .figures.figure import Picture
from .figures.style import as_text

_OVERVIEW = (
    "Every verdict of this report. Measured over predicted − 1 with its 95 % interval, from top to "
    "bottom within a scene its angles of incidence{more}; green: the scene's margin. Filled: the "
    "theory holds; open: it departs; half: undecided. No entry where a scene has no such light."
)
_EFFECTS = (
    "Measured over predicted − 1 at each angle of incidence, with its 95 % interval over {basis}. "
    "Green: the margin within which the theory counts as holding. Order 1 against single "
    "scattering by the first model, the total against all orders."
)
_LOBES = (
    "Lobes in the plane of incidence, Kd = {kd:g}, bins of 2° by 10°. θ_o is signed: positive on "
    "the side of the mirror direction (dotted vertical line), negative back towards the light. "
    "Points: traced on the explicit surface, bands 95 % over {basis}{bound}; a band that reaches "
    "the lower edge includes zero. Lines: theory over the same bins; coloured single "
    "scattering{walks}."
)
_BOUND = " (order 1: from the weights of its paths; all orders: an upper bound)"
_ALBEDOS = (
    "Albedo by the number of facets that light met, Kd = {kd:g}; each order has its own scale, all "
    "begin at zero. Bars: 95 % over {basis}.{higher}"
)
_NO_BARS = (
    "Albedo by the number of facets that light met, Kd = {kd:g}; each order has its own scale, all "
    "begin at zero. One surface: no interval over others.{higher}"
)
_HIGHER = " Order 1 against single scattering, higher orders against the {walks}."
_RELIEF = (
    "The first surface: a profile, not to scale, and the share of its facets that are steeper than "
    "a slope, against STD. Dotted: the steepest facet, where the mesh ends and the theory goes on."
)


def of_all(entries: Sequence[Validation]) -> list[Picture]:
    """All scenes in one picture."""
    rows = overview.rows({entry.name: entry.comparisons for entry in entries})
    if not rows:
        return []
    several = any(len(entry.scene.material.kd) > 1 for entry in entries)
    caption = _OVERVIEW.format(more=" and substrates" if several else "")
    return [Picture("overview", overview.figure(rows), caption, rows)]


def of_scene(entry: Validation, slug: str) -> list[Picture]:
    """Effects, lobes, albedos and the surface; those that there are."""
    scene, kd = entry.scene, entry.scene.material.kd[0]
    basis = entry.comparisons[0].basis if entry.comparisons else "nothing"
    walks = _walks(entry)
    one = entry.measured.sizes["realisation"] == 1
    pictures = []
    if entry.comparisons:
        compared = verdicts.rows(entry.comparisons)
        figure = verdicts.figure(compared)
        caption = _EFFECTS.format(basis=basis)
        pictures.append(Picture(f"{slug}-effects", figure, caption, compared))
    curves = lobes.rows(entry.measured, entry.predicted, scene, kd)
    if curves:
        black = f", black all orders by the {walks}" if walks else ""
        caption = _LOBES.format(kd=kd, basis=basis, bound=_BOUND if one else "", walks=black)
        pictures.append(Picture(f"{slug}-lobes", lobes.figure(curves), caption, curves))
    orders = albedo_by_order.rows(entry.measured, entry.predicted, scene, kd)
    if orders:
        later = walks and any(row["order"] > 1 for row in orders)
        higher = _HIGHER.format(walks=walks) if later else ""
        caption = (_NO_BARS if one else _ALBEDOS).format(kd=kd, basis=basis, higher=higher)
        pictures.append(Picture(f"{slug}-albedos", albedo_by_order.figure(orders), caption, orders))
    if entry.heightfield is not None:
        profile = surface.rows(entry.heightfield, scene)
        figure = surface.figure(profile, scene.roughness.gamma, as_text(entry.unit))
        pictures.append(Picture(f"{slug}-surface", figure, _RELIEF, profile))
    return pictures


def _walks(entry: Validation) -> str:
    """Name the theories of all orders that the scene was predicted by; no text if there is none."""
    named = [MODELS[key] for key in entry.predicted if key in MODELS]
    two = entry.scene.layers is not None
    return " and the ".join(
        f"{model.label}{' on IL facets of the interface' if two and not model.layered else ''}"
        for model in named
        if model.walk is not None
    )
