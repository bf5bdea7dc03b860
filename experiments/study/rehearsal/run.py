"""Run a rehearsal by starting the study's server and sending simulated participants to it."""

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Annotated

import httpx
import msgspec

from experiments.errors import ConfigError, RecordError
from experiments.study.file import Study
from experiments.study.plan import plan_of
from experiments.study.rehearsal.person import Rehearsed, SimulatedPerson, Surroundings
from experiments.study.rehearsal.plan import Planned, link_parameters, plan_people, rehearsed
from experiments.study.rehearsal.player import homes_in
from experiments.visit.folders import VISITS, VisitFolders
from experiments.visit.phases import phases_of
from mjsim.support.files import write_text_atomically

SERVED, PLAN, PEOPLE, SERVER_LOG = "served", "plan.json", "people.jsonl", "server.log"
DATABASE = "study.db"  # database in the folder of the server
WORKERS = "20"  # maximum number of concurrent trials, which need not run in real time
END_TIMEOUT = 60.0  # maximum time until the server has stopped, in seconds
HTTP_TIMEOUT = 120.0  # timeout for HTTP requests, in seconds


class RehearsalSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of a rehearsal, which are stored in its folder so that the rehearsal can be resumed."""

    study: str  # SHA-256 of the study file
    people: Annotated[int, msgspec.Meta(ge=1, le=100_000)]
    seed: int
    per_minute: float  # mean number of arrivals per minute of study time
    dropouts: float  # fraction of participants who leave early
    factor: float  # factor by which waiting times are divided


async def rehearse(
    study: Study,
    settings: RehearsalSettings,
    out: Path,
    film: Path | None,
    on_person: Callable[[Rehearsed], None],
) -> list[Rehearsed]:
    """Simulate all visits that have not ended yet, and return the results of all participants in order.

    Args:
        film: Video of the house, or None to let the server create the video.
        on_person: Function that is called for each visit that has ended, including visits of an earlier run.

    Raises:
        ConfigError: The folder contains a different rehearsal.
        RecordError: The server did not start, or stopped unexpectedly.
    """
    _keep(settings, out)
    known = read_people(out / PEOPLE)
    names = [phase.name for phase in phases_of(plan_of(study))]
    planned = plan_people(
        names, settings.people, settings.seed, per_minute=settings.per_minute, dropouts=settings.dropouts
    )
    done = {one.number: one for one in known.values() if one.outcome not in ("", "stuck")}
    for one in done.values():
        on_person(one)
    left = [person for person in planned if person.number not in done]
    if left:
        async with _server(study, settings, out, film) as base:
            await _send(study, settings, out, base, left, known, on_person)
    return [known[one.number] for one in planned]


def read_people(path: Path) -> dict[int, Rehearsed]:
    """Read the latest record of each simulated participant, and return the records by number."""
    lines = path.read_bytes().splitlines() if path.is_file() else []
    found = {}
    for line in lines:
        with contextlib.suppress(msgspec.DecodeError):  # the last line may be incomplete
            rehearsed = msgspec.json.decode(line, type=Rehearsed)
            found[rehearsed.number] = rehearsed
    return found


def _keep(settings: RehearsalSettings, out: Path) -> None:
    path = out / PLAN
    text = msgspec.json.format(msgspec.json.encode(settings)).decode() + "\n"
    if path.is_file() and path.read_text() != text:
        raise ConfigError(f"{path} is that of another rehearsal; choose another --out, or the same settings")
    out.mkdir(parents=True, exist_ok=True)
    write_text_atomically(path, text)


def _command(study: Study, settings: RehearsalSettings, out: Path, film: Path | None) -> list[str]:
    """Return the command that serves a rehearsal. It names the database, as the environment may name the real one."""
    served = (out / SERVED).absolute()
    command = [sys.executable, "-m", "experiments.cli.main", "study", "serve", str(study.path), "--no-open"]
    command += ["--out", str(served), "--database", f"sqlite:///{served / DATABASE}", "--port", "0"]
    command += ["--rehearsal", str(settings.factor), "--trusted-proxy", "127.0.0.1", "--workers", WORKERS]
    return command if film is None else [*command, "--film", str(film)]


@asynccontextmanager
async def _server(
    study: Study, settings: RehearsalSettings, out: Path, film: Path | None
) -> AsyncIterator[str]:
    with (out / SERVER_LOG).open("ab") as log:
        process = await asyncio.create_subprocess_exec(
            *_command(study, settings, out, film),
            stdout=asyncio.subprocess.PIPE,
            stderr=log,
            start_new_session=True,
        )  # a separate session, so that the server does not receive Ctrl-C
        try:
            url = (await process.stdout.readline()).decode().strip() if process.stdout else ""
            if not url:
                raise RecordError(f"the server did not start; see {out / SERVER_LOG}")
            yield url.rstrip("/")
            if process.returncode is not None:
                raise RecordError(f"the server ended by itself; see {out / SERVER_LOG}")
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.terminate()
            try:
                await asyncio.wait_for(process.wait(), END_TIMEOUT)
            except TimeoutError:
                process.kill()


async def _send(
    study: Study,
    settings: RehearsalSettings,
    out: Path,
    base: str,
    people: Sequence[Planned],
    known: dict[int, Rehearsed],
    on_person: Callable[[Rehearsed], None],
) -> None:
    plan, home = plan_of(rehearsed(study, settings.factor)), homes_in(VisitFolders(out / SERVED / VISITS))
    parameters = link_parameters(study, plan.recruiter)
    # Do not keep idle connections, because the client checks every connection before each request.
    limits = httpx.Limits(max_connections=None, max_keepalive_connections=0)
    async with httpx.AsyncClient(base_url=base, timeout=HTTP_TIMEOUT, limits=limits) as client:
        around = Surroundings(base, client, plan, home, parameters, settings.factor)
        with (out / PEOPLE).open("ab", buffering=0) as kept:

            async def live(planned: Planned, wait: float) -> None:
                await asyncio.sleep(wait)
                rehearsed = known.setdefault(planned.number, Rehearsed(planned.number))
                person = SimulatedPerson(planned, around, rehearsed)
                try:
                    if not rehearsed.link:
                        await person.begin()
                        kept.write(msgspec.json.encode(rehearsed) + b"\n")
                    await person.go()
                except (httpx.HTTPError, TimeoutError) as error:
                    rehearsed.faults.append(f"no answer: {type(error).__name__}: {error}")
                    rehearsed.outcome = "stuck"
                kept.write(msgspec.json.encode(rehearsed) + b"\n")
                on_person(rehearsed)

            new = [one.arrives for one in people if one.number not in known]
            async with asyncio.TaskGroup() as group:
                for one in people:
                    wait = one.arrives - new[0] if one.number not in known else 0.0
                    group.create_task(live(one, wait / settings.factor))
