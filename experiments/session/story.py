"""The story of the task that every participant reads first (PAPER sections 4 and 7)."""

from pathlib import Path

from experiments.errors import ConfigError
from mjsim.support.files import read_text

STORY_FILE = Path(__file__).with_name("story.md")
READING_SPEED = 238.0  # words a minute (Brysbaert, Journal of Memory and Language 109, 2019)


def story_text(path: Path | None = None) -> str:
    """The story of a UTF-8 file, or of this package: plain text with blank lines between paragraphs."""
    file = path or STORY_FILE
    try:
        text = read_text(file).strip()
    except OSError as error:
        raise ConfigError(f"cannot read the story {file}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"the story {file} is not UTF-8: {error}") from error
    if not text:
        raise ConfigError(f"the story {file} is empty; write at least one sentence")
    return text


def reading_time(text: str) -> float:
    """How long an adult takes to read a text silently, s."""
    return 60.0 * len(text.split()) / READING_SPEED
