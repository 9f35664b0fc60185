"""The benchmark of recordings that disagree: what its table counts."""

from benchmarks.agreement.tables import agreement


def test_a_disagreement_of_another_recording_counts_apart():
    rows = [
        {"change": "nothing", "odd": "last", "disagreements": []},
        {"change": "nothing", "odd": "last", "disagreements": [["log_1", "a.b", 0.01, []]]},
        {"change": "weaker", "odd": "last", "disagreements": [["last", "torque_gain.gain", 0.01, []]]},
    ]
    lines = agreement({"sets": rows})
    assert lines[2].startswith("| nothing | 2 | 0 of 2")
    assert "1 of 2" in lines[2]
    assert "torque gain gain (1)" in lines[3]
