"""Stages that the benchmark of hidden robots runs."""

from benchmarks.hidden_robots.robots import run


def test_what_a_stage_says_lies_in_its_folder_and_does_not_keep_it_from_running(tmp_path):
    folder = tmp_path / "regulator"
    for _ in range(2):  # the second time there is nothing left to do
        run("lqr", folder, [])
    assert (folder / "policy.pt").exists()
    assert "policy.pt" in (folder / "output.log").read_text()
