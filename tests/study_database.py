"""New databases of studies as copies of one, because making the tables takes longer than many tests."""

import asyncio
import functools
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from experiments.visit.store.engine import Database
from experiments.visit.store.upgrade import upgrade


def new_database(path):
    """URL of a database, which is made with all tables and nobody in it unless it is there."""
    if not path.exists():
        path.write_bytes(_tables())
    return f"sqlite:///{path}"


@functools.cache
def _tables():
    async def make(file):
        database = Database(f"sqlite:///{file}")
        await upgrade(database)
        await database.close()

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.db"
        with ThreadPoolExecutor(1) as thread:  # a test that drives a browser has an event loop in its own
            thread.submit(asyncio.run, make(file)).result()
        return file.read_bytes()
