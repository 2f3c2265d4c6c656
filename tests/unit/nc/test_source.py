"""Files as lines."""

import gzip

import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.nc.source import load_source, with_lines


def test_lines_are_counted_as_editors_count_them(tmp_path):
    path = tmp_path / "a.cls"
    path.write_bytes("\ufeffA\r\nB\rC\x0c\u2028D\nE".encode())
    assert load_source(path).lines == ["A", "B", "C\x0c\u2028D", "E"]


def test_a_packed_file_reads_as_its_content(tmp_path):
    path = tmp_path / "a.cls.gz"
    path.write_bytes(gzip.compress(b"A\nB", mtime=0))
    assert load_source(path).lines == ["A", "B"]


def test_a_file_of_old_encoding_is_read(tmp_path):
    path = tmp_path / "a.cls"
    path.write_bytes("PARTNO/Flügel".encode("cp1252"))
    assert load_source(path).lines == ["PARTNO/Flügel"]


@pytest.mark.parametrize(
    ("name", "data", "fault"),
    [
        ("a.cls", b"GOTO/1,2,3\n\x00\x01", "a.cls:2: isn't a text file: it holds the byte 0x00"),
        ("a.cls", b"A\r\nB\rC\x02\n\x00", "a.cls:3: isn't a text file: it holds the byte 0x02"),
        ("a.cls", "GOTO/1,2,3".encode("utf-16"), "a.cls: .* looks like UTF-16; save it as UTF-8"),
        ("a.cls", "GOTO/1,2,3\n".encode("utf-16-be") * 50, "looks like UTF-16; save it as UTF-8"),
        ("a.cls", "GOTO/1,2,3\n".encode("utf-16-le") * 50, "looks like UTF-16; save it as UTF-8"),
        ("a.cls.gz", b"GOTO/1,2,3", "can't be unpacked: Not a gzipped file"),
        (
            "a.cls.gz",
            gzip.compress(b"GOTO/1,2,3" * 100, mtime=0)[:-12],
            "can't be unpacked: Compressed file ended",
        ),
        ("a.cls.gz", gzip.compress(b"GOTO/1,2,3", mtime=0)[:10] + b"\xff" * 20, "can't be unpacked"),
    ],
)
def test_what_is_not_text_is_refused(tmp_path, name, data, fault):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(ToolpathError, match=fault) as caught:
        load_source(path)
    assert caught.value.file == str(path)


def test_control_characters_of_tapes_are_left_out_with_a_note_and_stay_in_a_revised_file(tmp_path):
    path = tmp_path / "part.nc"
    path.write_bytes(b"\x00\x00%\r\nO1000\x0f\r\n\x12\x13G1 X1.\x7f\x14 Y2.\r\n\x11M30\r\n\x00")
    source = load_source(path)
    assert source.lines == ["%", "O1000", "G1 X1. Y2.", "M30", ""]
    [note] = source.notes
    assert (note.code, note.place.line, note.value) == ("control-characters", 1, 9.0)
    assert with_lines(source, {3: ("G1 X5.",)}).startswith(b"\x00\x00%\r\nO1000\x0f\r\nG1 X5.\r\n\x11M30")


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(ToolpathError, match="no such file"):
        load_source(tmp_path / "a.csv")
    with pytest.raises(ToolpathError, match="is a folder"):
        load_source(tmp_path)


def test_a_mesh_is_named_as_one_not_as_text_of_another_encoding(tmp_path):
    path = tmp_path / "part.STL"
    path.write_bytes(b"\0" * 84)
    with pytest.raises(ToolpathError, match="is a mesh, and a program or a list of locations is needed here"):
        load_source(path)
