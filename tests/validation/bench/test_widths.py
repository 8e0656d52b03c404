"""Ratios of widths are those of intervals that both reports have."""

import pytest

from validation.bench.widths import compare

EFFECTS = """quantity,theta_i_deg,phi_i_deg,kd,low_percent,high_percent
total,0,0,0.8,-1,{total}
total,30,0,0.8,2,2
body,0,0,0.8,0,{total}
"""
ALBEDOS = """theta_i_deg,phi_i_deg,kd,source,order,albedo,low,high
0,0,0.8,measured,1,0.5,0.4,{order}
0,0,0.8,measured,2,0.5,0.4,{order}
0,0,0.8,smith,1,0.5,,
{more}
"""
LOBES = "theta_i_deg,phi_i_deg,kd,source,quantity,theta_o_deg,brdf_per_sr,low,high\n"


def report(folder, total, order, more=""):
    (folder / "figures").mkdir(parents=True)
    texts = {"effects": EFFECTS, "albedos": ALBEDOS, "lobes": LOBES}
    for figure, text in texts.items():
        path = folder / "figures" / f"a-{figure}.csv"
        path.write_text(text.format(total=total, order=order, more=more))
    return folder


def test_total_and_orders(tmp_path):
    before = report(tmp_path / "before", 1, 0.6)
    after = report(tmp_path / "after", 3, 0.5, "0,0,0.8,measured,3,0.5,0.1,0.9")
    total, orders = compare(before, after)
    assert (total["scene"], total["section"], total["intervals"]) == ("a", "total", 1)
    assert total["median"] == pytest.approx(2.0)
    assert (orders["section"], orders["intervals"]) == ("orders", 2)
    assert orders["median"] == pytest.approx(0.5)
