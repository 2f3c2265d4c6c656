import base64
import hashlib
import html
import re
from collections.abc import Callable
from dataclasses import replace

from fiveaxis.base.findings import risk
from fiveaxis.check import Report
from fiveaxis.model.energy.totals import KindEnergy
from fiveaxis.posture import Optimum
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.facts import Overriding, ProgramFigures
from fiveaxis.show.report.page import compose_page
from fiveaxis.show.report.words import number, saving

Page = Callable[..., str]
THIN = "\u2009"
# Anything that a browser would fetch: an address, or a source that isn't inlined.
OUTSIDE = re.compile(r"""(?:https?:)?//[a-z]|(?:src|href)=["'](?!data:|\#)""")


def body_text(page: str) -> str:
    """Return the words of a page in their order, without figures and style."""
    bare = re.sub(r"(?s)<(style|svg|script).*?</\1>|<[^>]+>", " ", page)
    return re.sub(r"[ \n]+", " ", html.unescape(bare))


def test_the_page_states_the_figures_of_the_solution(page: Page, solution: Optimum, verdict: Report) -> None:
    text = body_text(page(solution, verdict))
    normal = solution.baselines["normal"]
    share = 100.0 * (1.0 - solution.energy.total / normal.total)
    assert f"{share:.1f}{THIN}% less energy: " in text
    for energy in (solution.energy, normal):
        for joules in (energy.total, energy.travel, *energy.by_axis.values()):
            assert f" {joules:,.0f} ".replace(",", THIN) in text
    assert "360 locations" in text
    assert f"found – {12_000:,}".replace(",", THIN) in text


def test_a_path_without_errors_is_called_safe_only_as_far_as_checked(
    page: Page, solution: Optimum, verdict: Report
) -> None:
    text = body_text(page(solution, verdict))
    assert "! Only in part: no errors, but not every risk was checked." in text
    assert "Risk gouges: add part (--part) to the job." in text
    assert "Yes: " not in text


def test_an_unsafe_verdict_stands_before_every_saving(
    page: Page, solution: Optimum, unsafe_verdict: Report
) -> None:
    text = body_text(page(solution, unsafe_verdict))
    assert "✗ No: don’t run this program." in text
    assert text.index("No: don’t run") < text.index("What does it save?") < text.index("% less")
    assert "But this doesn’t count until the errors are corrected." in text
    assert "Yes: " not in text


def test_errors_that_are_overridden_stand_first_with_who_overrides_them(
    page: Page, solution: Optimum, unsafe_verdict: Report
) -> None:
    who = "the job file <cup>.toml (override)"
    found = page(solution, unsafe_verdict, overriding=Overriding({"axis-limit": 1_500}, who))
    text = body_text(found)
    assert '<section class="answer verdict overridden">' in found
    assert f"Overridden axis-limit (1{THIN}500), by {who}. The program was written with them" in text
    assert "✗ No: errors were found, and accepted by name." in text
    assert "Yes: " not in text
    assert text.index("Overridden axis-limit") < text.index("What does it save?")


def test_what_still_keeps_the_program_back_is_named_beside_what_is_overridden(
    page: Page, solution: Optimum, unsafe_verdict: Report
) -> None:
    accepted = Overriding({"axis-limit": 1_500}, "cup.toml")
    text = body_text(page(solution, unsafe_verdict, kept_back={"gouge": 3}, overriding=accepted))
    assert "Kept back No NC program was written, because of gouge (3)." in text
    assert "was written with them" not in text


def test_the_page_states_how_many_blocks_were_inserted_and_removed(
    page: Page, solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    text = body_text(page(solution, verdict, program=program))
    message = (
        "12 blocks were inserted (tolerance 0.005 mm); their postures were optimised too. 82 redundant blocks"
    )
    assert message in text
    assert "The program has 290 blocks for 360 locations" in text


def test_the_page_states_why_no_block_was_removed(
    page: Page, solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    none = replace(program, removed=0)
    kept = replace(none, redundant_kept_for=("gouge", "tip-deviation"))
    text = body_text(page(solution, verdict, program=kept))
    assert "were kept; without them: gouge, tip-deviation." in text
    assert "No block was redundant." in body_text(page(solution, verdict, program=none))


def test_errors_are_shown_first_and_all_findings_are_counted(
    page: Page, solution: Optimum, unsafe_verdict: Report
) -> None:
    text = page(solution, unsafe_verdict)
    # 150 are listed by verification; 1 530 were found, with two causes.
    table = text[text.index("Findings by cause") :]
    assert table.count("is below the limit") == 2
    assert f"1 error (axis-limit 1{THIN}500), 1 warning (tip-deviation 30)" in text
    assert f"1{THIN}530 findings, one row for each cause; the JSON report lists 150 places" in text
    head = r'<th class="(error|warning)" scope="row">\1</th>'
    rows = re.findall(head + r'<td>([a-z-]+)</td><td class="number">([^<]*)</td><td>vase', text)
    assert rows == [("error", "axis-limit", f"1{THIN}500"), ("warning", "tip-deviation", "30")]


def test_a_machine_without_base_power_is_not_given_a_total(
    page: Page, solution: Optimum, verdict: Report
) -> None:
    text = body_text(page(solution, verdict))
    assert "of the best baseline, normal (feed drives only)." in text
    assert "The machine’s base power isn’t known" in text


def test_a_machine_with_base_power_is_given_a_total(
    page: Page, solution_with_base: Optimum, verdict: Report
) -> None:
    text = body_text(page(solution_with_base, verdict))
    assert f"With base power: plus 2{THIN}763 W over the cycle time" in text
    assert number(solution_with_base.energy.with_base) in text
    assert "of the best baseline, normal (feed drives and base power over the cycle time)." in text


def test_a_baseline_that_is_missing_is_named_with_its_reason(
    page: Page, solution: Optimum, verdict: Report
) -> None:
    assert "as-programmed isn’t shown: the input has no tool axes" in body_text(page(solution, verdict))


def test_a_solution_without_any_baseline_is_still_reported(
    page: Page, solution: Optimum, verdict: Report
) -> None:
    text = body_text(page(replace(solution, compared={}), verdict))
    assert "There is no baseline to compare with" in text
    assert "% less" not in text


def test_an_assumed_figure_of_the_machine_is_marked(page: Page, solution: Optimum, verdict: Report) -> None:
    text = page(solution, verdict)
    assert (
        '<th scope="row">A limits</th><td>min -120.0, max 30.0, unit deg</td><td class="warning">assumed</td>'
        in text
    )
    assert "4 of 10 figures are assumed" in text


def test_a_name_cannot_smuggle_markup_into_the_page(
    page: Page, solution: Optimum, unsafe_verdict: Report
) -> None:
    nasty = "<script>alert('1')</script>&$title.apt"
    finding = replace(unsafe_verdict.findings[-1], message=nasty, value=99.0)
    text = page(
        replace(
            solution,
            toolpath=replace(solution.toolpath, name=nasty),
            compared={nasty: solution.compared["normal"]},
            missing={nasty: nasty},
        ),
        replace(
            unsafe_verdict,
            findings=(finding, *unsafe_verdict.findings),
            gaps=((risk(nasty), None),),
            figures={nasty: 1.0},
        ),
    )
    assert text.count("<script") == 1  # the page's own
    assert nasty not in text
    assert text.count(html.escape(nasty)) >= 8


def test_the_page_needs_no_network(page: Page, solution: Optimum, verdict: Report) -> None:
    text = page(solution, verdict)
    # Neither pictures nor the hashes of the page's policy are addresses.
    own = re.sub(r"(data:image/png;base64,|sha256-)[\w+/=]+", "data:", text)
    assert OUTSIDE.findall(own) == []
    assert text.count("data:image/png;base64,") == 4
    assert text.count("<svg") == 8


def test_the_page_runs_its_own_script_alone(page: Page, solution: Optimum, verdict: Report) -> None:
    text = page(solution, verdict)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]  # type: ignore[index]
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in policy
    for tag in ("style", "script"):
        (inline,) = re.findall(rf"(?s)<{tag}>(.*?)</{tag}>", text)
        digest = base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert re.search(r"<[^>]* (style|on\w+)=", text) is None


def test_the_page_is_small_however_long_the_path(
    page: Page, solution: Optimum, long_solution: Optimum, verdict: Report
) -> None:
    assert len(page(solution, verdict)) < 450_000
    assert len(long_solution.toolpath) > 35_000
    assert len(compose_page(ReportDocument(long_solution, verdict))) < 700_000


def test_every_chart_says_in_words_what_it_shows(page: Page, solution: Optimum, verdict: Report) -> None:
    charts = re.findall(r"<svg[^>]*>", page(solution, verdict))
    assert all(re.search(r'role="img" aria-label="[^"]{20,}"', chart) for chart in charts)
    assert [re.findall(r'data-over="([^"]*)"', chart) for chart in charts] == [
        *([], [], ["location"], ["location"], ["time in s"], ["time in s"], [], [])
    ]


def test_ids_on_the_page_are_unique(page: Page, solution: Optimum, verdict: Report) -> None:
    ids = re.findall(r' id="([^"]+)"', page(solution, verdict))
    assert len(ids) == len(set(ids))


def test_shares_are_worded_as_less_or_more() -> None:
    assert saving(0.2051) == f"20.5{THIN}% less"
    assert saving(-0.031) == f"3.1{THIN}% more"
    assert saving(0.0004) == "no change"
    assert saving(None) == "unknown"


def test_numbers_have_a_true_minus_and_no_negative_zero() -> None:
    assert number(-3072.4, signed=True) == f"\u22123{THIN}072"
    assert number(155.6, signed=True) == "+156"
    assert number(-0.2, signed=True) == "0"
    assert number(None) == "unknown"


def test_the_headline_compares_whole_programs_and_shows_kinds_of_moves_apart(
    page: Page, solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    cut, rapid = KindEnergy(1000.0, 5.0, 6.0), KindEnergy(234.0, 5.0, 1.0)
    kinds = {"cut": cut, "rapid": rapid}
    double = {letter: 2.0 * joules for letter, joules in solution.energy.by_axis.items()}
    normal = replace(
        solution.compared["normal"], energy=replace(solution.energy, by_axis=double, by_kind=kinds)
    )
    compared = replace(solution, compared=dict(solution.compared) | {"normal": normal})
    text = body_text(page(compared, verdict, program=program))
    assert "Energy of whole programs" in text
    assert "50.0\u2009% less" in text
    assert "rapid moves (J)" in text
    assert "links (J)" not in text
