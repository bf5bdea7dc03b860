"""An open link, and a lab in which one person follows another at one computer."""

from collections.abc import Mapping

from experiments.people.recruitment.base import Arrival, Leaving, WayBack


class OpenLink:
    """Everybody who has the link may take part, and gets a link of their own to come back to.

    Args:
        platform: `link`, or `lab`, which never offers the visit of the person before.
        code: Shown at the end; empty for none.
    """

    parameters: tuple[str, ...] = ()

    def __init__(self, platform: str = "link", code: str = "") -> None:
        self.platform, self._code = platform, code

    def arrive(self, query: Mapping[str, str]) -> Arrival:  # noqa: ARG002 - the link says nothing
        """A new person."""
        return Arrival()

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002 - nobody is known
        """A code where there is one."""
        return WayBack(self._code if how == "finished" else "")
