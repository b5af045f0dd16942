"""Text of others on a terminal: nothing in it is obeyed, and no line is taken for ours."""

from kilotwin.files.plain_text import plain, quoted


def test_what_a_terminal_obeys_is_shown_in_letters() -> None:
    title = "\x1b]0;owned\x07"
    assert plain(f"a{title}\tb\r\nc") == "a\\x1b]0;owned\\x07\tb\\r\nc"
    assert plain("\x9b31m \u202e") == "\\x9b31m \\u202e"
    assert plain("Grüße, 100 µm") == "Grüße, 100 µm"


def test_no_line_of_a_block_begins_as_ours_do() -> None:
    assert quoted("kilotwin: all is well\nx") == "  | kilotwin: all is well\n  | x"
