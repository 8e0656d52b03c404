"""Citations collected from what a report used, and from nothing else."""

from collections.abc import Iterable, Iterator

from ..analysis.validation import Validation
from ..invariants import referee
from ..model import MODELS
from ..physics import metals
from ..scene import ENGINES, Citation, Material
from ..trace.engine import engine_of
from .references import BY_KEY, REFERENCES

ALWAYS = ("microsurf", "harris2020", "virtanen2020", "hoyer2017", "hunter2007")
"""What every report uses, whatever its scenes."""
COMPILED = "lam2015"
"""What tracing takes, whatever the engine."""
SPREAD = ("tukey1951", "williams1962", "satterthwaite1946")
"""Rays and surfaces separated; there must be several surfaces."""

# The three glasses of d'Eon 2023 by (γ, σ).
_GLASSES = {(2.81, 0.428), (2.82, 0.524), (1.8, 0.406)}
# Parameter sets of Ribardière 2018 by (γ, σ, n).
_OF_2018 = {(1.75, 0.7, 1.5), (8.0, 0.7, 1.0), (1.75, 0.5, 1.5)}
_METALS = {"gold": "johnson1972", "copper": "johnson1972", "aluminium": "rakic1995"}


def of_scene(entry: Validation) -> set[str]:
    """Keys of what the measurement, the models and the statistics of one scene rest on."""
    needs = entry.scene.requires
    material = entry.scene.material
    used = {work if isinstance(work, str) else work.key for work in _of_entries(entry)}
    used |= _of_material(material)
    if needs.roughness:
        used |= {COMPILED, *_of_slopes(entry)}
        if needs.interface and not needs.substrate:
            used |= {"torrance1967", "cook1982"}
        if not needs.interface:
            used.add("oren1994")
    if entry.measured.sizes["realisation"] > 1:
        used |= set(SPREAD)
    return used


def _of_entries(entry: Validation) -> Iterator[str | Citation]:
    """What the engine and the models of a scene rest on; a user BRDF has no entry."""
    if entry.scene.requires.roughness:  # no engine takes part in a plane
        traced = {engine_of(entry.scene)}
        if any(row.name == referee.NAME and row.figures for row in entry.invariants):
            traced |= {*referee.pair(entry.scene)}
        for name in traced:
            yield from ENGINES[name].citations
    for key in entry.predicted:
        if key in MODELS:
            yield from MODELS[key].citations


def _of_slopes(entry: Validation) -> set[str]:
    """Where the distribution of slopes, its parameters and the surface come from."""
    rough, index = entry.scene.roughness, entry.scene.material.n
    used = {"ribardiere2017"}
    if entry.fit is not None:
        used.add("white1982")
    else:
        used.add("ribardiere2019")
    if rough.gamma == 2:
        used.add("walter2007")
    if (rough.gamma, rough.sigma_x) in _GLASSES and rough.isotropic:
        used.add("deon2023")
    if (rough.gamma, rough.sigma_x, index) in _OF_2018 and rough.isotropic:
        used.add("ribardiere2018")
    if "Sq" in entry.statistics:
        used.add("iso25178")
    return used


def _of_material(material: Material) -> set[str]:
    """An interface over a substrate; a metal whose index is one of `physics.metals`."""
    if material.conductor:
        return {
            _METALS[name]
            for name, rows in metals.METALS.items()
            if (material.n, material.k) in {(row.n, row.k) for row in rows}
        }
    if material.n > 1 and max(material.kd) > 0:
        return {"simonot2009", "meneveaux2018"}
    return set()


def collect(entries: Iterable[Validation], cited: Iterable[str] = ()) -> list[Citation]:
    """References of a report; ``cited`` by its other sections.

    In the order of `references`, then works that only the entry of a model or an engine has.

    Raises
    ------
    ValueError
        If a section cites what `references` does not hold.

    """
    used = {*ALWAYS, *cited}
    current: dict[str, Citation] = {}
    for entry in entries:
        used |= of_scene(entry)
        current |= {work.key: work for work in _of_entries(entry) if isinstance(work, Citation)}
    unknown = used - BY_KEY.keys() - current.keys()
    if unknown:
        raise ValueError(f"not in the list of references: {sorted(unknown)}")
    listed = [reference for reference in REFERENCES if reference.key in used]
    return listed + [work for key, work in current.items() if key not in BY_KEY]


def bibtex(references: Iterable[Citation]) -> str:
    """References as a .bib file."""
    return "\n\n".join(reference.bibtex for reference in references) + "\n"
