"""Admit new and returning participants through the welcome page."""

import asyncio
import hmac
import logging
import time
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from experiments.visit.plan import DEVICE
from experiments.visit.procedure import Procedure
from experiments.visit.recruiter import Candidate, InvalidLink, Preview
from experiments.visit.server.pages import VisitPages
from experiments.visit.store import PersonRow
from experiments.visit.tokens import Keys, new_token, token_hash
from experiments.web.server.guards import Rate, sent_form

LOG = logging.getLogger("mjsim.study")
NEW_PEOPLE = 60, 60.0  # maximum number of new participants per IP address, and the period in seconds
COUNTED = 10.0  # how long the number of free places is cached, in seconds
COUNTED_FULL = 1.0  # how long the number of free places is cached if it is 0, in seconds
TOKEN = "token"  # name of the form field for the token that the browser has stored


class Admission:
    """Request handlers that admit participants to a study."""

    def __init__(self, procedure: Procedure, pages: VisitPages, keys: Keys) -> None:
        self._procedure, self._pages, self._keys = procedure, pages, keys
        self._plan, self._store = procedure.plan, procedure.store
        self._recruiter = self._plan.recruiter
        self._new = Rate(*NEW_PEOPLE)
        self._counting = asyncio.Lock()
        self._room, self._counted = 0, 0.0  # cached number of free places, and its expiry time

    async def welcome(self, request: Request) -> Response:
        """Show the welcome page, or send a returning participant to their current phase."""
        came = self._recruiter.arrive(request.query_params)
        if isinstance(came, InvalidLink):
            LOG.warning("a link was refused: %s", came.reason)
            return self._pages.message(request, "unknown", 400)
        if isinstance(came, Candidate) and (person := await self._known(came)) is not None:
            return await self._again(request, came, person)
        if (closed := await self._closed()) is not None:
            return self._pages.closed(request, closed)
        return self._first_page(request, request.query_params, preview=isinstance(came, Preview))

    def _first_page(
        self, request: Request, ids: Mapping[str, str], status: int = 200, **values: Any
    ) -> Response:
        platform = self._recruiter.platform
        return self._pages.show(
            request,
            "welcome",
            status,
            section=self._plan.texts["welcome"],
            parameters={name: ids.get(name, "") for name in self._recruiter.parameters},
            remembers=platform == "link",
            picture=self._plan.has_picture,
            forgets=platform == "lab",
            device=self._plan.device if DEVICE in self._plan.phases else None,
            **values,
        )

    async def begin(self, request: Request) -> Response:
        form = {name: str(value) for name, value in (await sent_form(request)).items()}
        came = self._recruiter.arrive(form)
        if not isinstance(came, Candidate):
            return self._pages.message(request, "unknown", 400)
        if (person := await self._known(came)) is not None:
            return await self._again(request, came, person, form.get(TOKEN, ""))
        if (closed := await self._closed()) is not None:
            return self._pages.closed(request, closed)
        if not self._new.allows(request.client.host if request.client else "", came.key or ""):
            response = self._first_page(request, form, 429, note=self._plan.texts["welcome"]["busy"])
            response.headers["Retry-After"] = f"{NEW_PEOPLE[1]:.0f}"
            return response
        return await self._arrive(came)

    async def _known(self, came: Candidate) -> PersonRow | None:
        return None if came.key is None else await self._store.find(token_hash(self._keys.token(came.key)))

    async def _again(self, request: Request, came: Candidate, person: PersonRow, token: str = "") -> Response:
        """Let a participant return if all ids match, or if the browser has stored the participant's token.

        The platform id alone does not prove the participant's identity, because other people may know it. The
        id of the submission is known only to the participant.
        """
        same = came.identity == await self._store.identity(person.id)
        if came.key is not None and (
            same
            or person.status == "no_consent"  # the ids of participants without consent are not stored
            or hmac.compare_digest(token.encode(), self._keys.token(came.key).encode())
        ):
            return await self._arrive(came)
        LOG.warning("person %d comes with other ids than before, from another browser", person.id)
        section = self._plan.texts["returning"]
        ids = {name: came.identity.get(name, "") for name in self._recruiter.parameters}
        return self._pages.show(request, "returning", 403, section=section, parameters=ids)

    async def _arrive(self, came: Candidate) -> Response:
        token, key = new_token(), None
        if came.key is not None:
            token, key = self._keys.token(came.key), self._keys.person(came.key)
        first = self._procedure.names[0]
        person = await self._store.arrive(
            self._recruiter.platform, key, came.identity, token_hash(token), first
        )
        if not person.returning:
            self._room -= 1
            if self._room < 1:
                self._counted = 0.0
            LOG.info("person %d arrives", person.id)
        return RedirectResponse(f"/play/{token}", 303)

    async def _closed(self) -> str | None:
        """Return the name of the text that explains why the study is closed, or None if it is open."""
        state = (await self._store.study()).state
        if state != "open":
            return "not_open" if state == "paused" else "full"
        async with self._counting:  # concurrent requests share one database query
            if time.monotonic() > self._counted:
                self._room = await self._procedure.room()
                self._counted = time.monotonic() + (COUNTED if self._room > 0 else COUNTED_FULL)
        return None if self._room > 0 else "full"
