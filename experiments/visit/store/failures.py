"""Classify database errors, and explain what causes them and how to fix them."""

from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError, TimeoutError

DAMAGED = "is damaged: restore the last backup with `mjsim study restore`."
UNREACHABLE = "cannot be reached: check that its server runs."
PASSING = {
    "1205",  # MariaDB: lock wait timeout
    "1213",  # MariaDB: deadlock
    "40001",  # PostgreSQL: serialization failure
    "40P01",  # PostgreSQL: deadlock
}
# Error numbers of MariaDB, SQLSTATE codes of PostgreSQL or parts of messages, and the text that explains each
MEANINGS = (
    (
        ("1045", "1044", "28P01", "42501", "authentication failed", "FATAL:  role", "pg_hba.conf"),
        "refuses this user: check user, password and rights.",
    ),
    (
        ("1049", "3D000", "FATAL:  database"),
        "does not exist on its server: create it, empty, then start again.",
    ),
    (
        ("1021", "1114", "53100", "disk is full"),
        "has no space left: free some; nothing saved so far is lost.",
    ),
    (("not a database", "disk image is malformed"), DAMAGED),
    (("database is locked",), "is locked by another program for too long: close it, then try again."),
    (("readonly database",), "cannot be written: check the rights of the file and its folder."),
    (("unable to open",), "cannot be opened: check the rights of the file and its folder."),
    (("2002", "2003", "2006", "2013", "57P01", "57P02", "57P03", "connection failed"), UNREACHABLE),
)


def passes(error: SQLAlchemyError) -> bool:
    """Return True if the error is temporary, so that the transaction may succeed when it is retried."""
    if not isinstance(error, DBAPIError):
        return False
    return error.connection_invalidated or bool(_codes(error) & PASSING) or _meaning(error) == UNREACHABLE


def advice(error: SQLAlchemyError, database: str) -> str:
    """Return an error message that explains the cause and how to fix it."""
    if isinstance(error, TimeoutError):
        return (
            f"The database {database} is busy: every connection is in use. Try again, or let fewer people in."
        )
    if isinstance(error, IntegrityError):
        return f"The database {database} refuses a row that refers to nothing, or is there already: {error.orig}."
    if not isinstance(error, DBAPIError):
        return f"The database {database} failed: {error}"
    return f"The database {database} {_meaning(error) or f'failed: {error.orig}'}"


def damaged(database: str) -> str:
    return f"The database {database} {DAMAGED}"


def _meaning(error: DBAPIError) -> str | None:
    codes, text = _codes(error), str(error.orig)
    for signs, meaning in MEANINGS:
        if any(sign in codes or (len(sign) > 5 and sign in text) for sign in signs):
            return meaning
    return UNREACHABLE if error.connection_invalidated else None


def _codes(error: DBAPIError) -> set[str]:
    number = error.orig.args[:1] if error.orig is not None else ()
    return {str(code) for code in (*number, getattr(error.orig, "sqlstate", None))}
