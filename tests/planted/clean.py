"""What changes a program's text and nothing that the machine does: in each of these nothing is wrong."""

import re
from collections.abc import Iterator

from planted.fault import Subject
from planted.words import Text, with_words, words_of

# Words in a comment are none.
REMARK = "M5 T6 G91 F1 S0 at the end of shift 3, then G49"
CODE = re.compile(r"\b([GM])(\d)(?![\d.])")


def rewritten(text: Text) -> Text:
    """Rewrite every move's words with the same numbers."""
    return text.rewritten(lambda was: with_words(was, words_of(was)), text.moves)


def commented(subject: Subject) -> Text:
    """Put comments into the head and between the cuts."""
    template = {"apt": "$$ {}", "points": "# {}", "sinumerik": "; {}"}.get(subject.control, "({})")
    remark = f"; {REMARK}" if subject.is_klartext else template.format(REMARK)
    later = subject.text.inserted(subject.middle, remark)
    return later.inserted(subject.text.moves[0], remark)


def spaced(text: Text) -> Text:
    """Double the blanks, or put some behind commas."""
    lines = text.find(re.compile(r"^(?!0 BEGIN)"))
    return text.rewritten(lambda was: re.sub(r"(?<=\S) (?=\S)", "  ", was).replace(",", ", "), lines)


def renumbered(text: Text) -> Text:
    """Number the blocks, by 5; Klartext can only be counted by 1."""
    lines = [i for i, line in enumerate(text.lines) if re.match(r"[A-Z]", line) and not line.startswith("O")]
    for number, line in enumerate(lines, start=1):
        text = text.rewritten(lambda was, number=number: f"N{5 * number} {was}", [line])
    return text


def two_digits(text: Text) -> Text:
    """Write G and M with two digits."""
    lines = text.find(CODE)
    return text.rewritten(lambda was: CODE.sub(r"\g<1>0\2", was), lines)


def clean(subject: Subject) -> Iterator[tuple[str, Text]]:
    """Rewrite a program in each way that its language knows."""
    text = subject.text
    yield "as written", text
    yield "numbers", rewritten(text)
    yield "comments", commented(subject)
    yield "blanks", spaced(text)
    if not subject.is_list and not subject.is_klartext:
        yield "block numbers", renumbered(text)
        yield "two digits", two_digits(text)
