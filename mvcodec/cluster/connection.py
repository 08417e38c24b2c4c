"""A Dask cluster: one of this machine's own, or one whose scheduler is running already."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mvcodec.errors import InputError, MissingExtra, SettingError
from mvcodec.settings import Setting

EXTRA = "cluster"

_LOCAL = re.compile(r"local(?::([1-9]\d{0,3}))?")
_SCHEDULER = re.compile(r"(?:tcp|tls|ws|wss|ucx)://\S+")

CONNECT_SECONDS = 10

RETRIES = Setting("retries", int, 2, "how often a task is tried again whose worker died", low=0, high=999)


def check_cluster(text: str) -> str:
    """The same text, if it names a cluster.

    Raises:
        SettingError: it does not.
    """
    if not _LOCAL.fullmatch(text) and not _SCHEDULER.fullmatch(text):
        raise SettingError("cluster", text, "local, local:N or a scheduler's address such as tcp://host:8786")
    return text


def local_workers(cluster: str) -> int | None:
    """The workers of a cluster of this machine's own; None for another's."""
    local = _LOCAL.fullmatch(cluster)
    return None if local is None else int(local[1] or os.cpu_count() or 1)


@contextmanager
def connected(cluster: str, retries: int) -> Iterator[Any]:
    """A client of the cluster, a `distributed.Client`. A local cluster ends with the block.

    Args:
        cluster: ``local`` (one worker a core), ``local:N``, or the address of a scheduler.
        retries: see `RETRIES`; so often may a local worker die at one task before that counts as failed. A
            scheduler that is running has its own setting, `distributed.scheduler.allowed-failures`.

    Raises:
        SettingError: it names no cluster.
        MissingExtra: Dask is not installed.
        InputError: the scheduler cannot be reached.
    """
    check_cluster(cluster)
    try:
        import dask
    except ImportError as error:
        raise MissingExtra(str(error.name), EXTRA) from None
    workers = local_workers(cluster)
    # What workers log is told by us, in one line for each recording.
    own_settings = {"distributed.scheduler.allowed-failures": retries, "logging.distributed": "critical"}
    with dask.config.set(own_settings):
        try:
            import distributed
        except ImportError as error:
            raise MissingExtra(str(error.name), EXTRA) from None
        if workers is None:
            try:
                client = distributed.Client(cluster, timeout=CONNECT_SECONDS)
            except (OSError, TimeoutError) as error:
                found = str(error) or "no answer"
                raise InputError(cluster, " ".join(found.split()), "a running Dask scheduler") from None
            with client:
                yield client
            return
        with (
            distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            ) as own,
            distributed.Client(own) as client,
        ):
            yield client
