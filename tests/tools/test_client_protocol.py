"""The client's copy of the protocol is the one that its types give."""

from tools.client_protocol import PATH, client_protocol


def test_the_client_has_the_protocol_of_the_server():
    assert PATH.read_text("utf-8") == client_protocol(), "run `make client-protocol`"
