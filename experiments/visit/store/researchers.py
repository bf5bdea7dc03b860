"""Store the accounts of researchers, with passwords, roles and logins that can be revoked."""

import asyncio
import re
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, get_args

from sqlalchemy import insert, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.engine import Database
from experiments.visit.store.part import columns_of, transaction
from experiments.visit.store.tables import login, researcher
from experiments.visit.store.values import Researcher, Role, utc_now

if TYPE_CHECKING:
    from argon2 import PasswordHasher

PASSWORD_MEMORY_KIB = 65_536  # memory needed to hash a password, as recommended by RFC 9106
NAME = re.compile(r"[a-z0-9][a-z0-9._@-]{0,59}")
_FIELDS = columns_of(Researcher, researcher)


class Researchers:
    """Store methods for researchers and logins, which are shared by all studies in a database."""

    def __init__(self, database: Database, memory_kib: int) -> None:
        self._database = database
        self._memory_kib = memory_kib

    @cached_property
    def _hasher(self) -> "PasswordHasher":
        from argon2 import PasswordHasher  # `mjsim play` must work without this optional dependency

        return PasswordHasher(memory_cost=self._memory_kib)

    async def add(self, name: str, password: str, role: Role) -> Researcher:
        """Add a researcher. Raises StoreError if the name is taken, or if the name or role is not valid."""
        if not NAME.fullmatch(name):
            raise StoreError(f"{name!r} cannot be a name: use up to 60 of a-z, 0-9 and the signs . _ @ -")
        values = {"name": name, "role": _known(role), "disabled": False, "created": utc_now()}
        values["password"] = await self._hash(password)

        async def work(connection: Connection) -> Researcher:
            same = select(researcher.c.id).where(researcher.c.name == name)
            if (await connection.execute(same)).first() is not None:
                raise StoreError(f"There is a researcher {name!r} already: use another name.")
            await connection.execute(insert(researcher).values(**values))
            row = (await connection.execute(select(*_FIELDS).where(researcher.c.name == name))).one()
            return Researcher(*row)

        return await self._database.write(work)

    async def all(self) -> tuple[Researcher, ...]:
        return tuple(Researcher(*row) for row in await self._database.rows(select(*_FIELDS)))

    async def check(self, name: str, password: str) -> Researcher | None:
        """Return the researcher with these credentials, or None if they are wrong or the account is disabled.

        The check takes the same time for unknown names. The caller must limit the number of attempts.
        """
        query = select(*_FIELDS, researcher.c.password).where(researcher.c.name == name)
        found = await self._database.rows(query) if NAME.fullmatch(name) else ()
        if not found:
            await self._hash(password)
            return None
        (row,) = found
        from argon2.exceptions import VerifyMismatchError

        try:
            await asyncio.to_thread(self._hasher.verify, row.password, password)
        except VerifyMismatchError:
            return None
        return None if row.disabled else Researcher(*row[:-1])

    async def change(
        self,
        name: str,
        *,
        password: str | None = None,
        role: Role | None = None,
        disabled: bool | None = None,
    ) -> None:
        """Change a researcher's password, role or access. All logins of the researcher are revoked."""
        values: dict[str, object] = {}
        if password is not None:
            values["password"] = await self._hash(password)
        if role is not None:
            values["role"] = _known(role)
        if disabled is not None:
            values["disabled"] = disabled

        async def work(connection: Connection) -> None:
            who = (
                await connection.execute(select(researcher.c.id).where(researcher.c.name == name))
            ).scalar()
            if who is None:
                raise StoreError(f"There is no researcher {name!r}.")
            if values:
                await connection.execute(update(researcher).where(researcher.c.id == who).values(**values))
            mine = (login.c.researcher_id == who, login.c.revoked.is_(None))
            await connection.execute(update(login).where(*mine).values(revoked=utc_now()))

        await self._database.write(work)

    @transaction
    async def log_in(
        self, connection: Connection, researcher_id: int, token_hash: str, expires: datetime
    ) -> None:
        """Record a login. Only the SHA-256 of the login's token is stored."""
        values = {"researcher_id": researcher_id, "token_hash": token_hash, "expires": expires}
        await connection.execute(insert(login).values(**values, created=utc_now()))

    async def who(self, token_hash: str) -> Researcher | None:
        """Return the researcher who is logged in with this token hash, or None."""
        query = (
            select(*_FIELDS)
            .join(login, login.c.researcher_id == researcher.c.id)
            .where(login.c.token_hash == token_hash, login.c.revoked.is_(None))
            .where(login.c.expires > utc_now(), researcher.c.disabled.is_(False))
        )
        found = await self._database.rows(query)
        return Researcher(*found[0]) if found else None

    @transaction
    async def log_out(self, connection: Connection, token_hash: str) -> None:
        mine = (login.c.token_hash == token_hash, login.c.revoked.is_(None))
        await connection.execute(update(login).where(*mine).values(revoked=utc_now()))

    async def _hash(self, password: str) -> str:
        return await asyncio.to_thread(self._hasher.hash, password)


def _known(role: str) -> str:
    if role not in get_args(Role):
        raise StoreError(f"No role {role!r}; there are {', '.join(get_args(Role))}.")
    return role
