"""What an error of a database means, and what to do about it."""

from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError, TimeoutError

DAMAGED = "is damaged: restore the last backup with `mjsim study restore`."
PASSING = {
    "1205",  # MariaDB: waited too long for a lock
    "1213",  # MariaDB: deadlock
    "40001",  # PostgreSQL: conflict of two transactions
    "40P01",  # PostgreSQL: deadlock
}
# MariaDB's number, PostgreSQL's state or a part of SQLite's message -> what it means and what to do
MEANINGS = (
    (("1045", "1044", "28P01", "28000", "42501"), "refuses this user: check user, password and rights."),
    (("1049", "3D000"), "does not exist on its server: create it, empty, then start again."),
    (
        ("1021", "1114", "53100", "disk is full"),
        "has no space left: free some, nothing saved so far is lost.",
    ),
    (("not a database", "disk image is malformed"), DAMAGED),
    (("database is locked",), "is locked by another program for too long: close it, then try again."),
    (("readonly database",), "cannot be written: check the rights of the file and its folder."),
    (("unable to open",), "cannot be opened: check that its folder exists and can be written."),
    (("2002", "2003", "2006", "2013", "57P01", "57P03"), "cannot be reached: check that its server runs."),
)


def passes(error: SQLAlchemyError) -> bool:
    """Whether the same transaction may succeed if it is done again."""
    if not isinstance(error, DBAPIError):
        return False
    return error.connection_invalidated or bool(_codes(error) & PASSING)


def advice(error: SQLAlchemyError, database: str) -> str:
    """A sentence that says what is wrong and what to do."""
    if isinstance(error, TimeoutError):
        return (
            f"The database {database} is busy: every connection is in use. Try again, or let fewer people in."
        )
    if isinstance(error, IntegrityError):
        return f"The database {database} refuses a row that refers to nothing, or is there already: {error.orig}."
    cause = error.orig if isinstance(error, DBAPIError) else error
    codes, text = _codes(error), str(cause)
    for signs, meaning in MEANINGS:
        if codes.intersection(signs) or any(" " in sign and sign in text for sign in signs):
            return f"The database {database} {meaning}"
    if isinstance(error, DBAPIError) and (error.connection_invalidated or _unreachable(text)):
        return f"The database {database} cannot be reached: check that its server runs. ({text})"
    return f"The database {database} failed: {text}"


def damaged(database: str) -> str:
    """What to do about a damaged file."""
    return f"The database {database} {DAMAGED}"


def _codes(error: SQLAlchemyError) -> set[str]:
    """Number of MariaDB's error, or PostgreSQL's state."""
    cause = error.orig if isinstance(error, DBAPIError) else None
    codes = {str(getattr(cause, "sqlstate", None))}
    if cause is not None and cause.args:
        codes.add(str(cause.args[0]))
    return codes


def _unreachable(text: str) -> bool:
    return any(sign in text for sign in ("connect", "closed"))
