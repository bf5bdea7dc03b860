"""Names under which a server accepts requests, on a machine whose network is made up."""

import socket
from types import SimpleNamespace

import pytest

from experiments.web.server import guards


class Probe:
    """A socket of a machine with an IPv4 network, and without an IPv6 network."""

    def __init__(self, family, _):
        if family == socket.AF_INET6:
            raise OSError("no network of this family")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def connect(self, address):
        assert address[0] == "192.0.2.1"

    def getsockname(self):
        return "192.168.7.9", 4242


@pytest.fixture
def machine(monkeypatch):
    """Makes a machine whose own name stands for these addresses."""

    def make(*addresses):
        found = [(socket.AF_INET, None, None, "", (address, 0)) for address in addresses]
        network = {"socket": Probe, "getaddrinfo": lambda *_: found, "gethostname": lambda: "Desk"}
        monkeypatch.setattr(guards, "socket", SimpleNamespace(**{**vars(socket), **network}))

    return make


def test_the_outgoing_interface_is_accepted_even_if_the_machine_cannot_look_itself_up(machine):
    machine()
    assert {"192.168.7.9", "desk"} <= set(guards.allowed_hosts("0.0.0.0", None))


def test_addresses_of_the_own_name_are_accepted_only_by_a_server_for_the_network(machine):
    machine("10.0.0.5")
    assert "10.0.0.5" in guards.allowed_hosts("::", None)
    names = set(guards.allowed_hosts("127.0.0.1", "https://play.example.org:8443"))
    assert names == {"127.0.0.1", "[::1]", "localhost", "desk", "play.example.org"}
