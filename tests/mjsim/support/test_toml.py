"""One reader for all TOML files: what editors write is accepted, and what would take minutes is refused."""

import pytest

from mjsim.support.toml import MAX_DOTS, TomlError, parse_toml, read_toml


@pytest.mark.parametrize("content", [b"a = 1\n", b"\xef\xbb\xbfa = 1\r\n", b"\xef\xbb\xbf\r\na = 1"])
def test_files_of_all_editors_are_read(tmp_path, content):
    (tmp_path / "file.toml").write_bytes(content)
    assert read_toml(tmp_path / "file.toml") == {"a": 1}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = ", "at end of document"),
        ("a = 'ä'".encode("latin-1"), "byte 5 is not UTF-8"),
        (f"a{'.a' * 20_000} = 1", f"a key has more than {MAX_DOTS} dots"),
        ("[" + '"a" . ' * 20_000 + "a]", f"a key has more than {MAX_DOTS} dots"),
        (f"x = {{a{'.a' * 20_000} = 1}}", f"a key has more than {MAX_DOTS} dots"),
        (f"a = {'[' * 5000}{']' * 5000}", "nested too deep"),
        (f"a = {'9' * 5000}", "digits"),
    ],
)
def test_what_is_not_toml_is_refused_with_the_reason(tmp_path, text, reason):
    (tmp_path / "file.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(TomlError, match=reason):
        read_toml(tmp_path / "file.toml")


def test_dots_in_values_are_no_keys():
    text = f"a = '{'Signature ' + '.' * 300}'\nb = '{'A sentence. ' * 300}'\nc = {[0.5] * 300}\n[{'d.' * MAX_DOTS}d]\n"
    assert set(parse_toml(text)) == {"a", "b", "c", "d"}
