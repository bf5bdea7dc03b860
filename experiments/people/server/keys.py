"""What is made from a study's secret: the key by which a person is recognised, and the token of the person's link."""

import base64
import hashlib
import hmac


class Keys:
    """Keys of a study.

    Args:
        secret: Of the study.
        study: Name of the study.
    """

    def __init__(self, secret: bytes, study: str) -> None:
        self._secret, self._study = secret, study

    def person(self, platform_id: str) -> str:
        """The key of a platform's person, hexadecimal."""
        return self._digest(f"key:{platform_id}").hex()

    def token(self, platform_id: str) -> str:
        """The token of a platform's person, the same whenever that person comes."""
        return base64.urlsafe_b64encode(self._digest(f"token:{platform_id}")).decode().rstrip("=")

    def _digest(self, text: str) -> bytes:
        return hmac.new(self._secret, f"{self._study}:{text}".encode(), hashlib.sha256).digest()
