"""Cited is what a report used, and nothing else."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from microsurf.invariants.referee import NAME
from microsurf.model import MODELS
from microsurf.physics import metals
from microsurf.report import citations
from microsurf.report.references import BY_KEY, REFERENCES
from microsurf.scene import ENGINES, Accuracy, Material, Roughness, Scene
from microsurf.scene.builtin import built_in_scenes

ROUGH = {"smith": None, "vcavity": None, "smith-walk": None}
FRESNEL = {"simonot2009", "meneveaux2018", "cook1982"}
SMITH = {"smith1967", "heitz2014", "heitz2016"}


def entry(scene, predicted=None, realisations=4, fit=None, statistics=None, referee=None):
    """What citations look at."""
    rough = scene.requires.roughness
    return SimpleNamespace(
        scene=scene,
        predicted=predicted or (ROUGH if rough else {"flat": None}),
        measured=SimpleNamespace(sizes={"realisation": realisations}),
        fit=fit,
        invariants=[] if referee is None else [SimpleNamespace(name=NAME, figures=referee)],
        statistics={"Sq": 1.0} if rough and statistics is None else statistics or {},
    )


def keys(*args, **kwargs):
    return {reference.key for reference in citations.collect([entry(*args, **kwargs)])}


def test_without_an_interface_nothing_of_fresnel_is_cited():
    found = keys(Scene(material=Material(1.0, (0.8,))))
    assert not found & FRESNEL
    assert {"oren1994", *SMITH} <= found


def test_a_flat_scene_cites_neither_slopes_nor_masking_nor_embree():
    found = keys(Scene(roughness=Roughness(2.0, (0.0,))))
    assert found == {*citations.ALWAYS, *citations.SPREAD, "simonot2009", "meneveaux2018"}


def test_a_mirror_has_no_substrate_to_cite():
    found = keys(Scene(material=Material(1.5, (0.0,)), accuracy=Accuracy(engine="embree")))
    assert not found & {"simonot2009", "meneveaux2018", "oren1994"}
    assert {"cook1982", "torrance1967", "wald2014"} <= found


def test_engines_are_cited_that_traced():
    """Embree as the referee, too; not where it was absent."""
    assert "wald2014" not in keys(Scene())
    assert "wald2014" not in keys(Scene(), referee={})
    assert "wald2014" in keys(Scene(), referee={"albedo": 0.5})


def test_only_models_that_were_asked():
    alone = keys(Scene(), {"smith": None})
    assert not alone & {"heitz2016", "torrance1967"}
    assert {"smith1967", "heitz2014"} <= alone
    assert not keys(Scene(), {"vcavity": None}) & SMITH


@pytest.mark.parametrize("name", metals.METALS)
def test_a_metal_cites_the_table_of_its_index(name):
    row = metals.METALS[name][0]
    found = keys(Scene(material=Material(row.n, k=row.k)))
    tables = {"gold": "johnson1972", "copper": "johnson1972", "aluminium": "rakic1995"}
    assert found & {"johnson1972", "rakic1995"} == {tables[name]}
    other = keys(Scene(material=Material(row.n, k=row.k * 1.01)))
    assert not other & {"johnson1972", "rakic1995"}


def test_one_surface_has_nothing_between_surfaces():
    assert not keys(Scene(), realisations=1) & set(citations.SPREAD)
    assert set(citations.SPREAD) <= keys(Scene(), realisations=2)


def test_a_fit_cites_how_and_a_made_surface_from_where():
    fitted = keys(Scene(), fit="a fit")
    assert "white1982" in fitted
    assert "ribardiere2019" not in fitted
    made = keys(Scene())
    assert "white1982" not in made
    assert "ribardiere2019" in made
    assert "iso25178" not in keys(Scene(), statistics={"ks": 0.1})


def test_parameters_are_cited_where_they_are_used():
    scenes = {path.stem: Scene.read(path) for path in built_in_scenes()}
    cites = {name: keys(scene) for name, scene in scenes.items()}
    for key, word in (("deon2023", "glass"), ("ribardiere2018", "r18")):
        assert {name for name, found in cites.items() if key in found} == {
            name for name in scenes if word in name
        }
    assert {name for name, found in cites.items() if "walter2007" in found} == {
        name for name, scene in scenes.items()
        if scene.roughness.gamma == 2 and scene.requires.roughness
    }  # fmt: skip
    changed = replace(scenes["04-glass-frosted"], roughness=Roughness(2.81, (0.43,)))
    assert "deon2023" not in keys(changed)


def test_further_sections_cite_too_and_only_what_is_known():
    assert [
        r.key for r in citations.collect([], ["oren1994"]) if r.key not in citations.ALWAYS
    ] == ["oren1994"]
    with pytest.raises(ValueError, match="nobody2000"):
        citations.collect([], ["nobody2000"])


def test_every_reference_can_be_cited_once():
    assert len(BY_KEY) == len(REFERENCES)
    reachable = {*citations.ALWAYS, citations.COMPILED, *citations.SPREAD}
    entries = *MODELS.values(), *ENGINES.values()
    reachable |= {key for entry in entries for key in entry.citations}
    reachable |= {"johnson1972", "rakic1995", "white1982", "iso25178"}
    for path in built_in_scenes():
        reachable |= keys(Scene.read(path))
    assert reachable == set(BY_KEY)


def test_bibtex_has_every_entry_with_balanced_braces():
    text = citations.bibtex(REFERENCES)
    assert re.findall(r"^@\w+\{(\w+),$", text, re.MULTILINE) == [r.key for r in REFERENCES]
    for found in text.split("\n\n"):
        assert found.count("{") == found.count("}")
    assert "doi = {10.1145/2601097.2601199}" in text
    for reference in REFERENCES:
        assert not reference.doi or re.fullmatch(r"10\.\d{4}/\S+", reference.doi)


def test_this_tool_is_cited_as_its_citation_file_says():
    text = (Path(__file__).parents[2] / "CITATION.cff").read_text(encoding="utf-8")
    own = BY_KEY["microsurf"]
    assert f'title: "{own.title}"' in text
    assert f'name: "{own.authors[0]}"' in text
    assert f"date-released: {own.year}-" in text
