"""What a server of sessions can measure."""


class Meter:
    """Forgets what it is told; see subclasses."""

    def acknowledged(self, seconds: float) -> None:
        """The inputs of a message are safe, so long after they came."""

    def worker_lost(self) -> None:
        """The worker of a session has died."""
