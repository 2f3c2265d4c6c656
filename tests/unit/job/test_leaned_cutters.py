"""Jobs that plan passes for cutters other than balls, from the mesh to the verified program."""

import pytest
import trimesh

from fiveaxis.job import make_job, run_job


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    """A slanted wall around a low frustum."""
    part = trimesh.creation.revolve([[0, 0], [9, 0], [8, 2], [0, 2]], sections=90)
    file = tmp_path_factory.mktemp("wall") / "wall.stl"
    part.export(file)
    return file


def outcome_of(wall, **settings):
    return run_job(make_job(input=wall, machine="hayashi-640123", effort="quick", **settings))


@pytest.mark.slow
def test_a_bull_nose_gets_a_verified_program_with_the_ridges_asked_for(wall):
    plan = {"scallop": 0.03, "spacing": 1.0}
    outcome = outcome_of(wall, tool="bull:6:1", tilt=(20.0, 75.0), plan=plan)
    assert outcome.ok
    assert "gouge" not in outcome.verdict.counts
    asked, largest = outcome.scallop
    assert asked == 0.03
    assert 0.3 * asked < largest <= 1.05 * asked
    assert outcome.document["scallop_mm"] == {"asked": asked, "largest": largest}


def test_a_flat_end_mill_without_bounds_on_lead_and_lean_is_told_to_give_them(wall):
    from fiveaxis.base.errors import SettingError

    with pytest.raises(SettingError, match=r"bound lead and lean \(--lead 5:15 --lean -2:2\)"):
        outcome_of(wall, tool="flat:6", tilt=(20.0, 75.0), plan={"scallop": 0.03})


def test_a_scallop_of_a_ball_is_not_measured_again(wall):
    outcome = outcome_of(wall, tool="ball:6", tilt=(20.0, 75.0), plan={"scallop": 0.1, "spacing": 2.0})
    assert outcome.scallop is None
