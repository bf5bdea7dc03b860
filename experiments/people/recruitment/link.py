"""An open link, and a lab in which one person follows another at one computer."""

from collections.abc import Mapping

from experiments.people.recruitment.base import Arrival, Leaving, WayBack


class OpenLink:
    """Everybody who has the link may take part, and gets a link of their own to come back to.

    Args:
        platform: `link`, or `lab`, where the last page leads to the first one for the next person.
        code: Shown at the end; empty for none.
    """

    parameters: tuple[str, ...] = ()
    has_time_limit = False
    embedded_by: tuple[str, ...] = ()

    def __init__(self, platform: str = "link", code: str = "") -> None:
        self.platform, self._code = platform, code

    def arrive(self, query: Mapping[str, str]) -> Arrival:  # noqa: ARG002 - the link says nothing
        return Arrival()

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002 - nobody is known
        """A code where there is one; in a lab, the first page."""
        code = self._code if how == "finished" else ""
        return WayBack(code, "/", label="next_person") if self.platform == "lab" else WayBack(code)
