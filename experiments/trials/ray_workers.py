"""A Ray cluster as the workers of a batch: machines that share its folder. Ray comes with the extra `ray`."""

import functools
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from experiments.errors import ConfigError

RETRIES = 5  # of a trial whose machine was lost


class _Cluster:
    """Takes trials as a pool of processes does; a trial takes one core."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        """Start a call somewhere, or again elsewhere if its machine is lost."""
        return _remote(fn).remote(*args).future()  # type: ignore[no-any-return]


@functools.cache
def _remote(fn: Callable[..., Any]) -> Any:
    import ray

    return ray.remote(num_cpus=1, max_retries=RETRIES)(fn)


@contextmanager
def ray_cluster(count: int) -> Iterator[_Cluster]:  # noqa: ARG001 - the cluster says how many cores it has
    """The cluster that RAY_ADDRESS names, else the one that runs here, else one of this machine alone."""
    try:
        import ray
    except ImportError as error:
        raise ConfigError("--executor ray needs Ray: pip install 'mjsim[ray]'") from error
    is_mine = not ray.is_initialized()
    if is_mine:
        try:
            ray.init(log_to_driver=False)
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise ConfigError(f"there is no Ray cluster to work on: {error}") from error
    try:
        yield _Cluster()
    finally:
        if is_mine:
            ray.shutdown()  # ends what still runs
