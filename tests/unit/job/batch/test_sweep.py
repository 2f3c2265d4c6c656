"""Sweeps: many jobs of one file."""

import tomllib
from pathlib import Path

import pytest

from fiveaxis.base.errors import JobError
from fiveaxis.job import read_job
from fiveaxis.job.batch.tasks import apply_values, read_sweep
from fiveaxis.job.description import LARGEST_SWEEP

FILE = Path("cup.toml")


def variants(text):
    return read_sweep(tomllib.loads(text), text, FILE)


def test_a_file_without_sweep_has_no_variants():
    assert variants('input = "a.csv"') == {}


def test_a_product_takes_each_with_each_and_the_last_key_runs_fastest():
    found = variants('[sweep]\ncombine = "product"\ncone = [10, 20]\nmachine = ["a", "b"]\n')
    assert list(found.values()) == [
        {"cone": 10, "machine": "a"},
        {"cone": 10, "machine": "b"},
        {"cone": 20, "machine": "a"},
        {"cone": 20, "machine": "b"},
    ]
    assert list(found)[:2] == ["cone=10_machine=a", "cone=10_machine=b"]


def test_a_zip_takes_first_with_first():
    found = variants('[sweep]\ncombine = "zip"\ncone = [10, 20]\nmachine = ["a", "b"]\n')
    assert list(found) == ["cone=10_machine=a", "cone=20_machine=b"]


def test_one_list_needs_no_word_how_it_is_combined():
    assert list(variants("[sweep]\ntilt = [[15, 75], [30, 60]]\n")) == [
        "tilt=15,75",
        "tilt=30,60",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "[sweep]\nsetup.offset = [[0, 0, 50]]\n",
        '[sweep]\n"setup.offset" = [[0, 0, 50]]\n',
        "[sweep.setup]\noffset = [[0, 0, 50]]\n",
    ],
)
def test_keys_of_tables_are_written_as_toml_likes_it(text):
    ((name, values),) = variants(text).items()
    assert name == "setup.offset=0,0,50"
    assert apply_values(values, {"setup": {"rotation": [0, 0, 9]}}) == {
        "setup": {"rotation": [0, 0, 9], "offset": [0, 0, 50]}
    }


def test_names_stay_where_a_value_joins_the_list():
    few = variants("[sweep]\nfeed = [500, 1000.0]\n").keys()
    assert few < variants("[sweep]\nfeed = [250, 500, 750.5, 1000.0]\n").keys()


def test_names_are_names_of_one_folder_whatever_the_values_are():
    text = "x" * 300
    found = variants(
        f"[sweep]\nmachine = ['../../etc/a.toml', 'C:\\b.ini', '..', '/', '{text}', '{text}y', 'v1.']\n"
    )
    assert len(found) == 7
    assert not any(name.endswith(".") for name in found)  # Windows drops it
    assert all(len(Path(name).parts) == 1 and "\\" not in name and len(name) < 200 for name in found)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a = 1\nsweep = 3\n", 2, "must be a table"),
        ("[sweep]\n", 1, "varies nothing"),
        ("[sweep]\ncone = 20\n", 2, "sweep.cone = 20 must be a list of values"),
        ("[sweep]\ncone = []\n", 2, "sweep.cone = [] must be a list of values"),
        ("[sweep]\nplan.stepdown = 2\n", 2, "sweep.plan.stepdown = 2 must be a list"),
        ("[sweep]\ncone = [1]\nfeed = [2]\n", 1, "doesn't say how cone, feed are combined"),
        ('[sweep]\ncone = [1]\ncombine = "each"\n', 3, "has combine = 'each'"),
        ('[sweep]\ncombine = "zip"\ncone = [1, 2]\nfeed = [2]\n', 2, "unequal length (cone 2, feed 1)"),
        ("[sweep]\ncone = [20, 20.0]\n", 1, "two jobs of the name 'cone=20'"),
        ('[sweep]\nmachine = ["a", "A"]\n', 1, "two jobs of the name"),
        (f"[sweep]\ncone = {list(range(LARGEST_SWEEP + 1))}\n", 1, f"makes {LARGEST_SWEEP + 1} jobs"),
    ],
)
def test_a_wrong_sweep_is_reported_on_its_line(text, line, message):
    with pytest.raises(JobError) as caught:
        variants(text)
    assert (caught.value.file, caught.value.line) == ("cup.toml", line)
    assert message in caught.value.message


def test_a_huge_product_is_refused_before_it_is_made():
    lists = "".join(f"k{i} = {list(range(100))}\n" for i in range(9))
    with pytest.raises(JobError, match=f"makes {10**18} jobs"):
        variants(f'[sweep]\ncombine = "product"\n{lists}')


def test_a_cone_takes_the_place_of_the_tilt():
    assert apply_values({"cone": 20}, {"tilt": [15, 75]}) == {"cone": 20}
    assert apply_values({"tilt": [1, 2]}, {"cone": 20, "feed": 5}) == {"tilt": [1, 2], "feed": 5}


def test_a_variant_leaves_the_base_as_it_is():
    base = {"setup": {"offset": [0, 0, 0]}}
    apply_values({"setup.offset": [1, 2, 3]}, base)
    assert base == {"setup": {"offset": [0, 0, 0]}}


def test_a_key_inside_what_is_no_table_is_refused():
    with pytest.raises(JobError, match="plan is 3 in the job"):
        apply_values({"plan.stepdown": 1}, {"plan": 3})


def test_a_sweep_isnt_one_job(write_job):
    file = write_job("cup", "[sweep]\ntilt = [[15, 75]]\n")
    with pytest.raises(JobError, match=r"cup\.toml:4: is a sweep, .*fiveaxis batch"):
        read_job(file)
