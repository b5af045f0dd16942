"""Text that others wrote, as a terminal may show it: with nothing in it that the terminal obeys."""


def plain(text: str) -> str:
    """The text with characters that are not printed as Python writes them: \\x1b. Line ends and
    tabs stay."""
    if text.isprintable():
        return text
    return "".join(
        letter if letter.isprintable() or letter in "\n\t" else repr(letter)[1:-1]
        for letter in text
    )


def quoted(text: str) -> str:
    """The same as a block, of which no line can be taken for one of ours."""
    return "\n".join(f"  | {line}" for line in plain(text).splitlines())
