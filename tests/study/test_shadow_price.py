"""The study of what the shadow costs: its rows are what a run gives."""

from shadow_price import priced


def test_the_shadow_costs_less_than_maps_of_one_goal() -> None:
    row = priced("blackout", 1)
    assert row["equal"]
    assert row["cycles"] >= row["updates"] > 50
    assert row["payload_byte"] < row["downlink_byte"]
    assert 0 < row["downlink_share"] < 0.05
    assert row["bits_per_cycle"] < row["map_bits_per_cycle"]
    (time_s,) = row["catch_up_s"]
    assert 2.56 < time_s < 30
