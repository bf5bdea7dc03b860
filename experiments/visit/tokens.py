"""Tokens of personal links, and keys for recognizing the participants of a platform."""

import base64
import hashlib
import hmac
import re
import secrets

TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")


def new_token() -> str:
    return secrets.token_urlsafe(32)


def token_hash(token: str) -> str:
    """Return the SHA-256 of a token in hexadecimal. The token itself is never stored."""
    return hashlib.sha256(token.encode()).hexdigest()


class Keys:
    """Derives keys and tokens from a study's secret."""

    def __init__(self, secret: bytes, study: str) -> None:
        self._secret, self._study = secret, study

    def person(self, platform_id: str) -> str:
        """Return the key for a participant's platform id, in hexadecimal."""
        return self._digest(f"key:{platform_id}").hex()

    def token(self, platform_id: str) -> str:
        """Return the token for a participant's platform id. It is the same at each arrival."""
        return base64.urlsafe_b64encode(self._digest(f"token:{platform_id}")).decode().rstrip("=")

    def _digest(self, text: str) -> bytes:
        return hmac.new(self._secret, f"{self._study}:{text}".encode(), hashlib.sha256).digest()
