"""Tokens for personal links, and keys that identify returning participants."""

import base64
import hashlib
import hmac
import re
import secrets

TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")


def new_token() -> str:
    return secrets.token_urlsafe(32)


def token_hash(token: str) -> str:
    """Return the hexadecimal SHA-256 of a token. Only this hash is stored, never the token itself."""
    return hashlib.sha256(token.encode()).hexdigest()


class Keys:
    """A generator of keys and tokens, which are derived from a study's secret."""

    def __init__(self, secret: bytes, study: str) -> None:
        self._secret, self._study = secret, study

    def person(self, platform_id: str) -> str:
        """Return the hexadecimal key for a participant's platform id."""
        return self._digest(f"key:{platform_id}").hex()

    def token(self, platform_id: str) -> str:
        """Return the token for a participant's platform id. The same id always gives the same token."""
        return base64.urlsafe_b64encode(self._digest(f"token:{platform_id}")).decode().rstrip("=")

    def _digest(self, text: str) -> bytes:
        return hmac.new(self._secret, f"{self._study}:{text}".encode(), hashlib.sha256).digest()
