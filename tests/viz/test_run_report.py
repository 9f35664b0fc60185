"""The report is one page that needs nothing else, says what the summary says, and trusts no text."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from twbal.algorithm.iteration import Basis, DiagnosisOutcome, Iteration, PolicyFile, Reason, Search
from twbal.algorithm.summary import SimData, Summary
from twbal.algorithm.tables import trials_rows
from twbal.core.errors import DataError
from twbal.core.evaluation import PlaceBy, SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.core.palette import PALETTE
from twbal.search.predictor import Predictor
from twbal.viz.canvas import svg
from twbal.viz.learning_figure import learning_curve_figure
from twbal.viz.prediction_figures import prediction_figure
from twbal.viz.run_page import Pictures, RunSetup, what_was_done, write_report
from twbal.viz.trial_figures import Trials, drift_figure

RULE = SuccessCriterion(tilt_limit=np.radians(30), settled_tilt_limit=np.radians(10), settle_step=100, steps=500)
SETTING = RunSetup(True, RULE, 0.02, [], [("state", "tilt, speed"), ("<i>link</i>", "serial & lockstep")])
COMMANDS = "twbal sim-collect robot=paper && echo '<done>'\n"
VOID = {"meta", "br"}


def iteration(index: int, successes: int, trials: int = 10) -> Iteration:
    policy = PolicyFile(f"run/iteration_{index}/policy.pt", f"{index + 171:064x}")
    real = None if trials == 0 else 80.0 / (index + 1)
    coverage = None if trials == 0 else 0.06 + 0.2 * index
    drift = None if trials == 0 else 0.4
    return Iteration(
        index,
        index,
        60 * index,
        1.2 * index,
        8.0,
        real,
        successes,
        trials,
        coverage,
        2.0,
        10.0,
        drift,
        0.97,
        policy,
        "",
        50.0,
        None,
        Basis.CORRECTED if index else Basis.SIMULATION,
        Search.FOUND,
        DiagnosisOutcome.NOT_MADE,
        0.03,
        0.04,
    )


def summary(successes: Sequence[int] = (0, 4, 10), best: int = 2, trials: int = 10) -> Summary:
    iterations = tuple(iteration(i, count, trials) for i, count in enumerate(successes))
    return Summary("paper", 7, 199.6, SimData(20, 812), iterations, best)


@cache
def pictures(about: Summary) -> Pictures:
    decay = np.exp(-np.linspace(0, 3, 20))
    predicted = [Gaussian(np.array([x]), np.array([[0.01]])) for x in decay]
    drawn = [prediction_figure(predicted, [decay[:, None]], ["speed"], ["m/s"], 0.02, "it") for _ in about.iterations]
    drift = svg(drift_figure([Trials("0", [decay])], 0.02, RULE))
    return Pictures(None, [svg(f) for f in drawn], svg(learning_curve_figure(about)), drift, drift)


def written(folder: Path, about: Summary, setting: RunSetup = SETTING) -> str:
    write_report(folder / "report.html", about, setting, pictures(about), COMMANDS)
    return (folder / "report.html").read_text(encoding="utf-8")


class Page(HTMLParser):
    """Collects the tags and the text; complains where a tag is closed that is not open."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.words))


def test_the_page_is_well_formed_and_loads_nothing(tmp_path: Path) -> None:
    html = written(tmp_path, summary())
    page = Page(html)
    assert page.open == []
    assert not {"script", "link", "img", "iframe", "object", "image"} & {tag for tag, _ in page.tags}
    targets = [v for _, attrs in page.tags for k, v in attrs.items() if k in ("href", "xlink:href", "src")]
    assert targets and all(target and target.startswith("#") for target in targets)
    assert "@import" not in html and not re.search(r"url\((?!#)", html)


def test_no_two_figures_share_an_id_and_every_reference_has_its_target(tmp_path: Path) -> None:
    html = written(tmp_path, summary())
    ids = Counter(attrs["id"] for _, attrs in Page(html).tags if "id" in attrs)
    assert max(ids.values()) == 1
    references = set(re.findall(r'href="#([^"]+)"', html)) | set(re.findall(r"url\(#([^)]+)\)", html))
    assert references and references <= set(ids)


def test_every_figure_takes_the_colours_of_the_page(tmp_path: Path) -> None:
    body = written(tmp_path, summary()).split("</style>", 1)[1]
    assert not [colour.name for colour in PALETTE if colour.light in body]
    assert "var(--predicted)" in body and "var(--real)" in body


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    assert written(tmp_path, summary()) == written(tmp_path, summary())


def test_the_page_says_what_the_summary_says(tmp_path: Path) -> None:
    about = summary()
    page = Page(written(tmp_path, about))
    for words in ("812 samples", "20 rollouts", "0 of 10", "4 of 10", "10 of 10", about.best.policy.path):
        assert words in page.text
    assert about.best.policy.sha256 in page.text
    assert "the tilt stays within 30° for 10 s, and under 10° from 2 s on." in page.text
    assert "The 95 % band holds 46 % of the real states (of the measured channels, not of commands" in page.text
    assert "and positions); that of the tilt is ±1.7°, ±2.3° wide" in page.text
    assert len([tag for tag, attrs in page.tags if tag == "tr" and attrs.get("class") == "best"]) == 1


def test_what_is_said_of_the_table_of_trials_is_said_of_columns_that_it_has(tmp_path: Path) -> None:
    first, *later = summary().iterations
    about = replace(summary(), iterations=(replace(first, upright=10, settled=10), *later))
    text = Page(written(tmp_path, about)).text
    (name,) = re.findall("“([^”]+)” is how much the command changes", text)
    assert name.lower() in trials_rows(about)[0]


@pytest.mark.parametrize("by", PlaceBy)
def test_positions_by_odometry_are_told_from_true_ones_by_which_trials_are_judged(tmp_path: Path, by: PlaceBy) -> None:
    first, *later = summary().iterations
    text = Page(written(tmp_path, replace(summary(), iterations=(replace(first, place_by=by), *later)))).text
    assert "By odometry, from the start of each trial." in text
    assert ("trials are judged by the true pose" in text) == (by is PlaceBy.POSE)


@pytest.mark.parametrize("by", Predictor)
def test_a_band_of_robots_is_said_to_be_of_those_that_have_not_fallen(tmp_path: Path, by: Predictor) -> None:
    first, *later = summary().iterations
    text = Page(written(tmp_path, replace(summary(), iterations=(replace(first, predicted_by=by), *later)))).text
    assert text.count("the bands are of the robots that have not fallen yet") == (by is Predictor.ROBOTS)


def test_the_band_of_what_varies_is_named_by_its_place_as_it_is_darker_on_light_pages_only(tmp_path: Path) -> None:
    first, *later = summary().iterations
    text = Page(written(tmp_path, replace(summary(), iterations=(replace(first, tilt_unknown=0.86), *later)))).text
    assert "Of the tilt's variance 86 % is due to what is not known of the robot" in text
    assert "(the inner band)" in text and "darker" not in text


def test_text_from_outside_is_shown_and_not_obeyed(tmp_path: Path) -> None:
    hostile = "<script>alert(1)</script>"
    about = replace(summary(), robot=hostile)
    about = replace(about, iterations=tuple(replace(i, note=hostile) for i in about.iterations))
    html = written(tmp_path, about)
    assert hostile not in html and "<i>link</i>" not in html
    text = Page(html).text
    assert hostile in text and "<i>link</i>" in text and "serial & lockstep" in text and COMMANDS.strip() in text


def test_it_says_whether_the_robot_was_real(tmp_path: Path) -> None:
    claim, hardware = "No hardware was driven", "were driven on the robot behind the serial link"
    virtual = Page(written(tmp_path, summary())).text
    real = Page(written(tmp_path, summary(), replace(SETTING, virtual=False))).text
    assert claim in virtual and hardware not in virtual
    assert claim not in real and hardware in real and "(virtual)" not in real
    assert "to the same hashes" in virtual and "to the same hashes" not in real


def test_a_run_without_trials_makes_a_page_that_claims_nothing(tmp_path: Path) -> None:
    about = summary((0, 0), best=1, trials=0)
    page = Page(written(tmp_path, about))
    assert "nothing is known of how policy 1 balances the robot" in page.text and " of 0" not in page.text


def paragraphs(*changes: dict[str, object], ensemble: Sequence[str] = ()) -> list[str]:
    """What was done in a run whose iterations are changed so."""
    iterations = tuple(replace(iteration(i, 4), **each) for i, each in enumerate(changes))  # type: ignore[arg-type]
    return what_was_done(Summary("paper", 7, 199.6, SimData(20, 812), iterations, 0), ensemble)


RECALIBRATED = {"same_policy_as": 0, "search": Search.NOT_MADE, "real_seconds": 6.0, "real_episodes": 3}


def test_a_policy_that_is_only_driven_again_was_not_searched() -> None:
    first, second = paragraphs({}, RECALIBRATED)
    assert first.endswith("Policy 0 was searched on f. In its trials policy 0 succeeded in 4 of 10.")
    assert "Policy 0 drove the robot in 3 rollouts (6.0 s)." in second
    assert "No policy was searched: policy 0 stayed as it is" in second
    assert "A search" not in second


def test_a_search_that_keeps_a_policy_names_it() -> None:
    assert (
        "nothing better than policy 0, which was kept"
        in paragraphs({}, {"same_policy_as": 0, "search": Search.KEPT})[1]
    )
    assert "an earlier search on f found" in paragraphs({"search": Search.KEPT})[0]


def test_what_drove_is_the_policy_of_the_iteration_before() -> None:
    kept = {"same_policy_as": 0, "search": Search.KEPT}
    assert [said.split(" drove")[0] for said in paragraphs({}, kept, {}, {})[1:]] == [
        "Policy 0",
        "Policy 0",
        "Policy 2",
    ]


def test_policy_0_serves_the_variants_only_where_there_are_some() -> None:
    assert "(latency)" in paragraphs({}, ensemble=["latency"])[0]
    assert "differ" not in paragraphs({})[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"basis": Basis.DATA_SHEET, "search": Search.NOT_MADE}, "regulator of the linearised data sheet"),
        ({"basis": Basis.AGENT, "search": Search.NOT_MADE}, "a model-free agent that was trained in simulation"),
        (
            {"basis": Basis.ROBOT, "real_episodes": 5, "real_seconds": 1.9},
            "Random commands drove the robot in 5 rollouts",
        ),
    ],
)
def test_policy_0_of_another_method_was_not_searched_on_f(change: dict[str, object], said: str) -> None:
    (first,) = paragraphs(change)
    assert said in first
    assert "on f" not in first


@pytest.mark.parametrize(
    ("diagnosis", "said"),
    [
        (DiagnosisOutcome.USED, "was diagnosed and added to it, and f was learned again"),
        (DiagnosisOutcome.NOT_USED, "was not used: too much of the error was left"),
    ],
)
def test_a_diagnosis_is_told_where_it_was_made(diagnosis: DiagnosisOutcome, said: str) -> None:
    assert said in paragraphs({}, {"diagnosis": diagnosis})[1]
    assert "diagnos" not in " ".join(paragraphs({}, {}))


def test_letters_of_all_figures_are_of_one_size(tmp_path: Path) -> None:
    tags = [attrs for tag, attrs in Page(written(tmp_path, summary())).tags if tag == "svg"]
    widths = [float(str(attrs["viewbox"]).split()[2]) for attrs in tags]
    shown = [float(re.findall(r"max-width: (\d+)px", str(attrs["style"]))[0]) for attrs in tags]
    assert len(set(widths)) > 1
    assert [size / width for size, width in zip(shown, widths, strict=True)] == pytest.approx([1.35] * len(tags), 0.01)


def test_a_band_that_says_nothing_is_shown_with_its_width_and_a_warning(tmp_path: Path) -> None:
    about = summary((0, 10), best=1)
    wild = replace(about.iterations[1], coverage95=1.0, tilt_band_median=0.9, tilt_band_widest=np.radians(100))
    about = replace(about, iterations=(about.iterations[0], wild), tilt_limit=RULE.tilt_limit)
    text = Page(written(tmp_path, about)).text
    assert "100 % (±52°, ±100°)" in text
    assert "reaches ±100°, more than the tilt limit of ±30°" in text


def test_scores_expected_successes_and_the_reason_stand_in_the_table_and_under_the_picture(tmp_path: Path) -> None:
    about = summary((0, 10), best=1)
    scored = {"log_density": -1.25, "crps": 0.0312, "crps_of_trials": 0.02, "crps_ratio": 1.56}
    last = replace(about.iterations[1], success_probability=0.836, reason=Reason.BETTER, **scored)
    text = Page(written(tmp_path, replace(about, iterations=(about.iterations[0], last)))).text
    assert "new, expected better" in text
    assert "0.031 / 0.02" in text and "84 %" in text
    assert "97 %" in text  # of the first iteration, whose file notes no probability, the share
    assert "Its CRPS is 0.031, that of the trials' own spread 0.02; its mean log predictive density is -1.25" in text
    assert "10 of 10 trials succeeded; each was expected to with probability 0.84." in text


def test_a_missing_picture_is_an_error(tmp_path: Path) -> None:
    some = replace(pictures(summary()), predictions=[])
    with pytest.raises(DataError, match="for each of 3 iterations; found 0"):
        write_report(tmp_path / "report.html", summary(), SETTING, some, COMMANDS)
    assert not (tmp_path / "report.html").exists()
