"""Control access to the researcher's page with login cookies, roles and rate limits."""

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
# Maximum number of login attempts per address with one name and with any name, and the period in seconds. The attempts
# of other addresses do not count, so that no one can lock out a researcher.
ATTEMPTS, ALL_ATTEMPTS = (10, 300.0), (40, 300.0)
CHECKS = 2  # maximum number of concurrent password checks, each of which needs 64 MiB
ORDER: tuple[Role, ...] = ("viewer", "assistant", "owner")  # roles in order of increasing permissions


def may(who: Researcher, role: Role) -> bool:
    """Return True if a researcher has at least the permissions of a role."""
    return ORDER.index(who.role) >= ORDER.index(role)


class Access:
    """Session management for researchers, who log in with a name and a password."""

    def __init__(self, researchers: Researchers, *, secure: bool) -> None:
        self._researchers, self._secure = researchers, secure
        self._cookie = f"__Host-{COOKIE}" if secure else COOKIE
        self._from, self._names = Rate(*ALL_ATTEMPTS), Rate(*ATTEMPTS)
        self._checks = asyncio.Semaphore(CHECKS)

    async def who(self, connection: HTTPConnection) -> Researcher | None:
        """Return the logged-in researcher, or None if no researcher is logged in."""
        token = self._token(connection)
        return None if token is None else await self._researchers.who(token_hash(token))

    def may_try(self, address: str, name: str) -> bool:
        """Count a login attempt. Return True if the limits for the address and for its use of the name allow it."""
        return self._from.allows(address) and self._names.allows(f"{address} {name}")

    async def log_in(self, connection: HTTPConnection, name: str, password: str) -> str | None:
        """Log in a researcher. Return the token of the login, or None if the credentials are wrong."""
        async with self._checks:
            researcher = await self._researchers.check(name, password)
        if researcher is None:
            return None
        await self.log_out(connection)
        token = new_token()
        await self._researchers.log_in(researcher.id, token_hash(token), utc_now() + LASTS)
        return token

    async def log_out(self, connection: HTTPConnection) -> None:
        """Revoke the login that belongs to the cookie, if there is one."""
        if (token := self._token(connection)) is not None:
            await self._researchers.log_out(token_hash(token))

    def remember(self, response: Response, token: str) -> None:
        """Set the login cookie with `SameSite=strict`, so that other sites cannot use it in requests."""
        seconds = int(LASTS.total_seconds())
        response.set_cookie(
            self._cookie, token, seconds, httponly=True, secure=self._secure, samesite="strict"
        )

    def forget(self, response: Response) -> None:
        response.delete_cookie(self._cookie, httponly=True, secure=self._secure, samesite="strict")

    def _token(self, connection: HTTPConnection) -> str | None:
        token = connection.cookies.get(self._cookie, "")
        return token if TOKEN.fullmatch(token) else None
