"""Run trials on a Ray cluster whose machines share a folder. `pip install 'mjsim[ray]'` installs Ray."""

import functools
import logging
import os
import platform
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, InvalidStateError, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from experiments.errors import ConfigError
from experiments.session.signals import SIGNALS

TRIAL_BYTES = 300_000_000  # memory that a trial with compiled kernels uses, in bytes
QUEUED_PER_CORE = 2
PERIOD_S = 5.0  # interval between checks of the cluster
HEAD_TIMEOUT_S = 60.0  # maximum time for a restart of the cluster's head node
END_S = 10.0  # maximum time until cancelled calls have ended
# By default, Ray sends usage statistics. It also ends this process silently if the head node is lost.
ENVIRONMENT = {"RAY_gcs_rpc_server_reconnect_timeout_s": "600", "RAY_USAGE_STATS_ENABLED": "0"}
REMEDY = "install the same versions on all machines, then restart Ray there"
Versions = tuple[tuple[str, str], ...]


class LostMachineError(BrokenProcessPool):
    """Raised if a machine of the cluster is lost during a call."""


@contextmanager
def ray_cluster(
    workers: int | None, modules: Sequence[str], on_note: Callable[[str], None], folder: Path
) -> Iterator[Callable[[], AbstractContextManager["_Cluster"]]]:
    """Connect to the Ray cluster at RAY_ADDRESS, or to a local cluster, which is started if necessary.

    Raises:
        ConfigError: Ray is not installed, there is no cluster, or a machine cannot run trials of this batch.
    """
    os.environ.update(ENVIRONMENT | os.environ)
    try:
        import ray
    except ImportError as error:
        raise ConfigError("--executor ray needs Ray: pip install 'mjsim[ray]'") from error
    from experiments.trials.fingerprint import code_versions  # imported late because numba loads slowly

    if is_mine := not ray.is_initialized():
        _connect(ray)
    cluster = _Cluster(ray, workers, (folder, tuple(code_versions(modules).items())))
    try:
        cluster.prepare(on_note)
        yield lambda: nullcontext(cluster)
    finally:
        cluster.end()
        if is_mine:
            ray.shutdown()


def _connect(ray: Any) -> None:
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    # Ray has no option to silence the thread that prints the logs of lost machines.
    ray._private.worker.print_to_stdstream = lambda *_, **__: None
    try:
        if ":" in (address := os.environ.get("RAY_ADDRESS", "")):
            # This fails immediately if the cluster cannot be reached. Ray itself would retry for minutes.
            _reach(address)
        ray.init(log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, RuntimeError, ValueError) as error:
        raise ConfigError(f"cannot connect to a Ray cluster: {error}") from error
    if threading.current_thread() is threading.main_thread():
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _reach(address: str) -> None:
    host, _, port = address.rpartition(":")
    socket.create_connection((host, int(port)), PERIOD_S).close()


class _Cluster:
    def __init__(self, ray: Any, workers: int | None, needed: tuple[Path, Versions]) -> None:
        self._ray, self._workers, self._needed = ray, workers, needed
        self._call = ray.remote(max_retries=0)(_checked)
        self._running: dict[Future[Any], Any] = {}
        self._ended = threading.Event()
        self._machines, self._cores = self._count()

    @property
    def room(self) -> int:
        cores = self._cores
        return self._workers if self._workers and self._workers < cores else cores * QUEUED_PER_CORE

    def submit(self, fn: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
        result: Future[Any] = Future()
        options = options or {"num_cpus": 1, "memory": TRIAL_BYTES}
        self._running[result] = reference = self._call.options(**options).remote(*self._needed, fn, *args)
        reference.future().add_done_callback(functools.partial(self._finish, result))
        return result

    def _finish(self, result: Future[Any], done: Future[Any]) -> None:
        self._running.pop(result, None)
        with suppress(InvalidStateError):  # the call has already failed, because the cluster was lost
            if error := done.exception():
                result.set_exception(_translated(error))
            else:
                result.set_result(done.result())

    def prepare(self, on_note: Callable[[str], None]) -> None:
        """Check all machines, and load the numeric code on each before the trials start."""
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy as On

        from experiments.trials.design import counted
        from experiments.trials.warmup import compile_kernels

        threading.Thread(target=self._watch, daemon=True).start()
        used = "" if self.room >= self._cores else f"{self._workers} of "
        on_note(
            f"Ray: {used}{counted(self._cores, 'core')} on {counted(len(self._machines), 'machine')}; numeric code is "
            "loaded first, or compiled there after an installation or update, which takes a minute or two"
        )
        calls = {
            self.submit(compile_kernels, num_cpus=0, scheduling_strategy=On(node, soft=False)): name
            for node, name in self._machines.items()
        }
        for call in as_completed(calls):
            error = call.exception()
            if error is None or isinstance(error, BrokenProcessPool):  # ignore lost machines
                continue
            if isinstance(error, ConfigError | ConnectionError):
                raise error
            reason = (str(error).strip() or type(error).__name__).splitlines()[-1]
            raise ConfigError(f"machine {calls[call]} cannot run trials: {reason}; {REMEDY}") from error

    def end(self) -> None:
        self._ended.set()
        running = dict(self._running)
        for reference in running.values():
            self._ray.cancel(reference, force=True)
        wait(running, timeout=END_S)

    def _count(self) -> tuple[dict[str, str], int]:
        cores = {}
        for node in filter(lambda node: node["Alive"], self._ray.nodes()):
            resources = node["Resources"]
            room = int(min(resources.get("CPU", 0), resources.get("memory", 0) // TRIAL_BYTES))
            if room:
                cores[node["NodeID"], node["NodeManagerHostname"]] = room
        if not cores:
            raise ConfigError(
                f"no machine of the Ray cluster has a core and {TRIAL_BYTES / 1e9} GB of memory"
            )
        return dict(cores.keys()), sum(cores.values())

    def _watch(self) -> None:
        address = self._ray.get_runtime_context().gcs_address
        answered = time.monotonic()
        while time.monotonic() - answered < HEAD_TIMEOUT_S:
            if self._ended.wait(PERIOD_S):
                return
            with suppress(OSError, ConfigError):
                _reach(address)
                answered = time.monotonic()
                _, self._cores = self._count()
        lost = ConnectionError(
            f"the head of the Ray cluster at {address} does not answer; start it and try again"
        )
        while not self._ended.wait(0.1):
            with suppress(InvalidStateError, KeyError):  # the call has just ended, or no call is running
                self._running.popitem()[0].set_exception(lost)


@functools.cache
def _check_machine(folder: Path, versions: Versions) -> None:
    """Check that this machine has the same software versions as the driver and shares the work folder."""
    from experiments.trials.fingerprint import changes, code_versions

    expected, name = dict(versions), platform.node()
    modules = [key.removeprefix("module ") for key in expected if key.startswith("module ")]
    found = code_versions(modules)
    if wrong := changes(expected, found):
        listed = ", ".join(
            f"{key} is {found.get(key) or 'missing'} instead of {expected.get(key)}" for key in wrong
        )
        raise ConfigError(f"machine {name} differs from this one: {listed}; {REMEDY}")
    try:
        (folder / f"{name}-{os.getpid()}").touch()
    except OSError as error:
        raise ConfigError(
            f"machine {name} does not share {folder.parents[1]} ({error.strerror}); "
            "choose an --out that all machines can write"
        ) from error


def _checked(folder: Path, versions: Versions, fn: Callable[..., Any], *args: Any) -> Any:
    _check_machine(folder, versions)
    return fn(*args)


def _translated(error: BaseException) -> BaseException:
    from ray import exceptions

    if isinstance(error, exceptions.NodeDiedError | exceptions.TaskUnschedulableError):
        return LostMachineError(str(error))
    if isinstance(error, exceptions.WorkerCrashedError | exceptions.OutOfMemoryError):
        return BrokenProcessPool(str(error))
    return error.cause or error if isinstance(error, exceptions.RayTaskError) else error
