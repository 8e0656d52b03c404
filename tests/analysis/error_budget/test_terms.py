"""The arithmetic of budgets on numbers made up: terms add up, and each defect has its place."""

from dataclasses import replace

import numpy as np
import pytest
from judge import rate

from microsurf.analysis.error_budget.regions import FIRST, HIGHER, LOBES, REGIONS, TOTAL
from microsurf.analysis.error_budget.terms import Case, TermEstimate, split

THEORY = dict(zip((*FIRST, *HIGHER), (0.05, 0.4, 0.07, 0.02, 0.01), strict=True))
LOBE = {q: THEORY[kind] / 4 for kind in FIRST for q in LOBES if q.startswith(kind)}


def case(
    rng=None, *, noise=0.0, change=None, with_mesh_slopes=None, predicted=None, count=6, **more
):
    """A measurement on ``count`` surfaces that is the theory's, but for changes and noise."""
    theory = {q: TermEstimate(v) for q, v in (THEORY | LOBE).items()}
    measured = {}
    for q, v in (THEORY | LOBE).items():
        spread = np.zeros(count) if rng is None else rng.normal(0, noise * v, count)
        measured[q] = v * (1 + (change or {}).get(q, 0.0)) + spread
    slopes = {
        q: TermEstimate(e.value * (with_mesh_slopes or {}).get(q, 0.0)) for q, e in theory.items()
    }
    own = theory if predicted is None else {
        q: TermEstimate(e.value * (1 + predicted.get(q, 0.0))) for q, e in theory.items()
    }  # fmt: skip
    return Case(measured, {}, own, theory, slopes, scattered=0.6, **more)


def test_terms_add_up_to_the_difference():
    rng = np.random.default_rng(1)
    estimates = {q: TermEstimate(1e-3 * rng.normal(), 1e-4) for q in THEORY | LOBE}
    made = case(
        rng, noise=0.02, change={q: 0.1 * rng.normal() for q in THEORY},
        with_mesh_slopes={q: 0.05 * rng.normal() for q in THEORY}, predicted={FIRST[1]: 0.2},
        mesh=estimates, tile=dict.fromkeys(estimates, TermEstimate(0.0, 1e-3)), lost=1e-4,
    )  # fmt: skip
    found = split(made)
    assert set(found) == {*FIRST, *HIGHER, *LOBES, TOTAL}
    for q, terms in found.items():
        parts = (*FIRST, *HIGHER) if q == TOTAL else (q,)
        difference = sum(made.measured[p].mean() - made.predicted[p].value for p in parts)
        assert sum(t.value for t in terms.values()) == pytest.approx(difference, abs=1e-15)
        for term in terms.values():
            assert term.low <= term.value <= term.high


def largest(terms):
    return max(terms, key=lambda name: abs(terms[name].value))


def test_each_defect_has_its_term():
    slopes = split(case(change={FIRST[0]: -0.02}, with_mesh_slopes={FIRST[0]: -0.02}))
    masking = split(case(change={FIRST[0]: 0.1}))
    multiple = split(case(change={"order 4+": -1.0}))
    law = split(case(predicted={FIRST[1]: 0.02}))
    for found, q, term in (
        (slopes, FIRST[0], "slopes"),
        (masking, FIRST[0], "masking"),
        (multiple, "order 4+", "multiple"),
        (law, FIRST[1], "model"),
    ):
        assert largest(found[q]) == term
        others = [abs(t.value) for name, t in found[q].items() if name != term]
        assert max(others) < 1e-12
        # Of masking alone later orders would know too: see the next test.
        assert term == "masking" or largest(found[TOTAL]) == term


def test_light_let_out_at_first_is_not_met_again():
    """A tenth more of order 1 leaves a tenth less of what goes on: all of it is masking."""
    goes_on = 0.6 - THEORY[FIRST[0]] - THEORY[FIRST[1]]
    more = 0.1 * THEORY[FIRST[1]]
    change = {FIRST[1]: 0.1} | dict.fromkeys(HIGHER, -more / goes_on)
    found = split(case(change=change))
    for q in HIGHER:
        assert found[q]["masking"].value == pytest.approx(-THEORY[q] * more / goes_on)
        assert found[q]["multiple"].value == pytest.approx(0, abs=1e-15)
    later = sum(THEORY[q] for q in HIGHER)
    assert found[TOTAL]["masking"].value == pytest.approx(more * (1 - later / goes_on))


def test_what_is_not_known_of_order_1_is_passed_on_with_its_sign():
    """At Kd = 1 all light leaves: the masking of the total is known whatever order 1 is."""
    mesh = dict.fromkeys(THEORY | LOBE, TermEstimate(0.0)) | {FIRST[1]: TermEstimate(0.0, 0.01)}
    whole = case(mesh=mesh)
    whole = replace(whole, scattered=1.0, theory=dict(whole.theory))
    theory = dict(whole.theory) | {"order 4+": TermEstimate(1 - sum(THEORY.values()) + 0.01)}
    whole = replace(
        whole, theory=theory, predicted=theory,
        measured=whole.measured | {"order 4+": np.full(6, theory["order 4+"].value)},
    )  # fmt: skip
    found = split(whole)
    assert found[FIRST[1]]["masking"].high == pytest.approx(0.01)
    later = sum(found[q]["masking"].high - found[q]["masking"].value for q in HIGHER)
    assert later == pytest.approx(0.01)
    assert found[TOTAL]["masking"].high == pytest.approx(0, abs=1e-12)


def test_of_the_theory_itself_nothing_is_left(judge):
    """Intervals of masking and multiple hold 0 in 95 % of 400 draws.

    Negative control: a difference of two standard errors of the mean is outside far oftener.
    """
    rng = np.random.default_rng(judge.seed(2))
    draws, count = 400, 6
    inside = {"masking": 0, "multiple": 0, "shifted": 0}
    for _ in range(draws):
        found = split(case(rng, noise=0.02, count=count))
        term = found[FIRST[0]]["masking"]
        inside["masking"] += term.low <= 0 <= term.high
        term = found["order 2"]["multiple"]
        inside["multiple"] += term.low <= 0 <= term.high
        shift = 3 * 0.02 / np.sqrt(count)
        term = split(case(rng, noise=0.02, change={FIRST[0]: shift}))[FIRST[0]]["masking"]
        inside["shifted"] += term.low <= 0 <= term.high
    judge.keeps(rate([inside["masking"], inside["multiple"]], draws, 0.95))
    judge.catches(rate(inside["shifted"], draws, 0.95))


def test_another_order_of_substitution_is_part_of_the_uncertainty():
    narrow = split(case())[FIRST[0]]
    wide = split(case(exchange={FIRST[0]: 0.002}))[FIRST[0]]
    for term in ("slopes", "masking"):
        assert wide[term].value == narrow[term].value
        assert wide[term].high - wide[term].value >= 0.002


def test_regions_share_the_hemisphere():
    from microsurf.analysis.error_budget.regions import region_masks  # noqa: PLC0415

    assert np.all(region_masks().sum(axis=0) == 1)
    assert len(region_masks()) == len(REGIONS)
