"""The layout that the docs hand to Foxglove shows what logs have."""

import json
from pathlib import Path

from twbal.io.logs.layout import layout_of

LAYOUT = Path(__file__).parents[2] / "docs" / "foxglove_layout.json"


def panels(tree):
    """Names of the panels in a layout."""
    return {tree} if isinstance(tree, str) else panels(tree["first"]) | panels(tree["second"])


def test_every_panel_shows_a_field_that_is_there():
    layout = json.loads(LAYOUT.read_text())
    logged = layout_of(("tilt", "tilt_rate", "speed", "command_1", "command_2"))
    fields = {f"{topic.name}.{field}" for topic in logged.topics for field in topic.fields}
    assert panels(layout["layout"]) == set(layout["configById"])
    for panel in layout["configById"].values():
        assert all(path["value"] in fields for path in panel.get("paths", []))
        assert panel.get("topicPath", logged.events.name) == logged.events.name
