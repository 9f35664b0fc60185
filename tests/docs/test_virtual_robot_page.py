import runpy
from pathlib import Path

from twbal.virtual_robot.distribution import FaultDistribution

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_the_virtual_robot_says_what_the_configuration_says_of_every_range():
    written = runpy.run_path(str(ROOT / "scripts" / "virtual_robot.py"))
    assert written["PAGE"].read_text() == written["page"](), "Run `python scripts/virtual_robot.py`."
    assert set(FaultDistribution.ranges()) <= written["tabulated"]()
