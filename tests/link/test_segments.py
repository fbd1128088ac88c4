"""Reception reports: a part says nothing about what another part covers."""

from hypothesis import given
from hypothesis import strategies as st

from farside.link.endpoint.segments import Coverage, ReceptionReport, encode_part, reception_reports


def test_a_partial_report_says_nothing_about_the_rest() -> None:
    cut, last = (
        ReceptionReport(0, base=4, skipped=0, runs=(2, 1), rest=rest) for rest in (False, True)
    )
    assert [Coverage(cut).has(number) for number in (3, 4, 5, 6, 7)] == [
        True,
        False,
        False,
        True,
        None,
    ]
    assert Coverage(last).has(7) is False
    assert Coverage(cut).end == 7


@given(st.integers(0, 1000), st.sets(st.integers(1, 400)), st.integers(64, 200))
def test_the_parts_of_a_report_together_tell_the_truth_about_every_segment(
    base: int, gaps: set[int], size_byte: int
) -> None:
    beyond = {base + gap for gap in gaps}
    reports = reception_reports(base, beyond, 0, size_byte)
    assert all(len(encode_part(report)) <= size_byte for report in reports)
    for number in range(max(0, base - 2), base + 402):
        said = {told for report in reports if (told := Coverage(report).has(number)) is not None}
        assert said == {number < base or number in beyond}
