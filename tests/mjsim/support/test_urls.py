"""Passwords in URLs are hidden wherever a URL may be shown."""

import pytest

from mjsim.support.urls import parse_url, redacted


@pytest.mark.parametrize(
    "text",
    [
        "postgresql://ada:sesame@host/study",
        "--database=postgresql://ada:sesame@host/study",
        "mysql://ada:se@sesame:/#@host/study",
        "mysql://ada:open sesame@host/study",
        "mysql+aiomysql://:sesame@host",
        "postgresql://host/study?user=ada&password=sesame",
        "postgresql://host/study?sslpassword=sesame&user=ada",
        "cannot reach postgresql://ada:sesame@host/study: refused",
    ],
)
def test_passwords_are_hidden(text):
    assert "sesame" not in redacted(text) and "***" in redacted(text)


@pytest.mark.parametrize(
    "text",
    [
        "https://play.example.org:8443/",
        "http://[::1]:80/ or mail me@x.org",
        "postgresql://ada@host/x",
        "mysql://USER:PASSWORD@HOST",
    ],
)
def test_all_else_stays(text):
    assert redacted(text) == text


@pytest.mark.parametrize(
    "url", ["", "x", "ftp://x", "http://", "http://[::1", "http://a:99999", "http://a:b", "http://a:0"]
)
def test_urls_of_no_server_are_refused(url):
    with pytest.raises(ValueError):
        parse_url(url)


def test_a_url_of_a_server():
    url = parse_url("https://play.example.org:8443/x")
    assert (url.hostname, url.port, url.path) == ("play.example.org", 8443, "/x")
