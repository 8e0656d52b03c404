import numpy as np
import pytest

from validation.calibration import brdf_fit


def drawn(gamma, half):
    one = {"gamma": gamma, "gamma_ci": [gamma - half, gamma + half], "sigma": 0.3, "n": 1.5}
    one |= {"sigma_ci": [0.29, 0.31], "n_ci": [1.6, 1.7], "kd": list(brdf_fit.KD)}
    one["kd_ci"] = [[kd - 0.01, kd + 0.01] for kd in brdf_fit.KD]
    return {"1": one, "all": one}


def test_counts_of_a_table():
    table = list(brdf_fit.rows(300, [drawn(2.5, 0.1), drawn(2.75, 0.1)]))
    assert len(table) == 2 * (3 + len(brdf_fit.KD))
    by_name = {row["parameter"]: row for row in table if row["orders fitted"] == "all"}
    held = {name: row["held"] for name, row in by_name.items()}
    assert held == {"gamma": 1, "sigma": 2, "n": 0, "kd 0.1": 2, "kd 0.4": 2, "kd 0.8": 2}
    assert by_name["gamma"]["bias"] == pytest.approx(0.05)
    assert by_name["gamma"]["held_low"] < 0.5 < by_name["gamma"]["held_high"]


def test_pairs_are_seen_to_75_degrees():
    brdf = brdf_fit.draw(100, np.random.default_rng(1))
    assert brdf.pairs == 100
    assert np.degrees(max(brdf.theta_i.max(), brdf.theta_o.max())) < 75 + 1e-9
    assert len(np.unique(brdf.theta_i)) == brdf_fit.INCIDENCES
