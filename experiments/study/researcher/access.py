"""Who may see the researcher's page: logins by a cookie, roles, and limits to attempts."""

import asyncio
import datetime

from starlette.requests import HTTPConnection
from starlette.responses import Response

from experiments.visit.store import Researcher, Role
from experiments.visit.store.researchers import Researchers
from experiments.visit.store.values import utc_now
from experiments.visit.tokens import TOKEN, new_token, token_hash
from experiments.web.server.guards import Rate

COOKIE = "mjsim-login"
LASTS = datetime.timedelta(hours=12)
ATTEMPTS = 10, 300.0  # to log in, within this time, s, from one address and with one name
CHECKS = 2  # of passwords at a time: each takes 64 MiB
ORDER: tuple[Role, ...] = ("viewer", "assistant", "owner")  # each may do what those before may


def may(who: Researcher, role: Role) -> bool:
    """Whether somebody may do what a role may."""
    return ORDER.index(who.role) >= ORDER.index(role)


class Access:
    """Logs researchers in and out.

    Args:
        researchers: Of the store.
        secure: Whether the page is reached by HTTPS.
    """

    def __init__(self, researchers: Researchers, *, secure: bool) -> None:
        self._researchers, self._secure = researchers, secure
        self._cookie = f"__Host-{COOKIE}" if secure else COOKIE
        self._from, self._names = Rate(*ATTEMPTS), Rate(*ATTEMPTS)
        self._checks = asyncio.Semaphore(CHECKS)

    async def who(self, connection: HTTPConnection) -> Researcher | None:
        """Who asks; None for nobody who is logged in."""
        token = self._token(connection)
        return None if token is None else await self._researchers.who(token_hash(token))

    def may_try(self, address: str, name: str) -> bool:
        """Whether there may be another attempt from an address with a name; that counts."""
        return self._from.allows(address) and self._names.allows(name)

    async def log_in(self, connection: HTTPConnection, name: str, password: str) -> str | None:
        """A new token for who has this name and password, whatever cookie came along; None for nobody."""
        async with self._checks:
            researcher = await self._researchers.check(name, password)
        if researcher is None:
            return None
        await self.log_out(connection)
        token = new_token()
        await self._researchers.log_in(researcher.id, token_hash(token), utc_now() + LASTS)
        return token

    async def log_out(self, connection: HTTPConnection) -> None:
        """End the login of the cookie, if there is one."""
        if (token := self._token(connection)) is not None:
            await self._researchers.log_out(token_hash(token))

    def remember(self, response: Response, token: str) -> None:
        """Let the browser keep a token, and send it with what comes from the page itself alone."""
        seconds = int(LASTS.total_seconds())
        response.set_cookie(
            self._cookie, token, seconds, httponly=True, secure=self._secure, samesite="strict"
        )

    def forget(self, response: Response) -> None:
        response.delete_cookie(self._cookie, httponly=True, secure=self._secure, samesite="strict")

    def _token(self, connection: HTTPConnection) -> str | None:
        token = connection.cookies.get(self._cookie, "")
        return token if TOKEN.fullmatch(token) else None
