import pytest

from fiveaxis.base.errors import CodeError
from fiveaxis.model.machine.code import parse_code


def test_the_code_is_read_from_the_workpiece_to_the_tool():
    code = parse_code("640123")
    assert code.table == ("C", "A")
    assert code.head == ("X", "Y", "Z")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("640x23", "character 4 is 'x'"),
        ("6 40123", "character 2 is ' '"),
        ("647123", "character 3 is '7'"),
        ("64123", "has no bed; write one 0 where the bed is, for example 640123"),
        ("6401230", "2 beds"),
        ("CA0XYZ", "write 640123"),
        ("64012345", "has 8 digits"),
        ("6401234", "at most six different axes make seven"),
        ("1234567", "character 7 is '7'"),
        ("6401236", "names axis 6 (C) 2 times"),
        ("0", "has no axis"),
        ("٦40123", "character 1"),
    ],
)
def test_each_misuse_has_its_own_message(text: str, message: str):
    with pytest.raises(CodeError) as caught:
        parse_code(text)
    assert message in str(caught.value)
    assert caught.value.code == text
