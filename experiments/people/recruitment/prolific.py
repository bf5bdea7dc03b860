"""Prolific: links with three parameters, and completion codes in the address to which people return."""

import re
from collections.abc import Mapping
from urllib.parse import urlencode

from experiments.errors import ConfigError
from experiments.people.recruitment.base import Arrival, Leaving, Refusal, WayBack
from experiments.people.study_file import Recruitment

PERSON, STUDY, SUBMISSION = "PROLIFIC_PID", "STUDY_ID", "SESSION_ID"
RETURN = "https://app.prolific.com/submissions/complete"
_ID = re.compile(r"[0-9A-Za-z]{8,64}")
_CODE = re.compile(r"[0-9A-Za-z]{4,32}")


class Prolific:
    """People of one study of the platform.

    Args:
        settings: With the codes of the platform's study.

    Raises:
        ConfigError: A code is missing or is none.
    """

    platform = "prolific"
    parameters: tuple[str, ...] = (PERSON, STUDY, SUBMISSION)

    def __init__(self, settings: Recruitment) -> None:
        for name in ("completed", "screened_out", "no_consent"):
            if not _CODE.fullmatch(code := getattr(settings, name)):
                raise ConfigError(
                    f"study.recruitment.{name} is {code!r}; give the code that the platform shows for it"
                )
        self._codes: Mapping[Leaving, str] = {
            "finished": settings.completed,
            "screened_out": settings.screened_out,
            "no_consent": settings.no_consent,
        }
        self._study = settings.study_id

    def arrive(self, query: Mapping[str, str]) -> Arrival | Refusal:
        """Who comes, by the id of the person; another study's people are refused."""
        ids = {name: query.get(name, "") for name in self.parameters}
        if bad := [name for name, value in ids.items() if not _ID.fullmatch(value)]:
            return Refusal(f"{bad[0]} is missing or is no id")
        if self._study and ids[STUDY] != self._study:
            return Refusal(f"{STUDY} is not that of this study")
        return Arrival(ids[PERSON], ids)

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002 - the code says all
        """The platform's page with the code; who leaves returns the submission there, without one."""
        code = self._codes.get(how, "")
        return WayBack(code, f"{RETURN}?{urlencode({'cc': code})}" if code else "")
