"""``mvcodec batch``: one command on many recordings, over the workers of a Dask cluster."""

from __future__ import annotations

import argparse
import json
import re
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from mvcodec.cli.arguments import join_negative_values
from mvcodec.cli.cluster_options import add_cluster
from mvcodec.cli.info import count
from mvcodec.cli.progress import progress
from mvcodec.cli.setting_options import add_setting
from mvcodec.cluster.batch_inputs import find_recordings
from mvcodec.cluster.batch_run import SEGMENTED, Batch, Job, Option, Progress, run_batch
from mvcodec.cluster.connection import connected, local_workers
from mvcodec.cluster.places import Place
from mvcodec.errors import MvCodecError, MvCodecWarning, SettingError
from mvcodec.workers import WorkerSettings, thread_count

PURPOSES = {
    "encode": "code array folders, in segments that are joined",
    "decode": "synthesise the views of coded files",
    "render": "make pictures to take away of coded files",
    "validate": "check files against the rules of the format",
}

OWN = ("--json", "--quiet", "--overwrite", "-y", "--dry-run", "--continues")
"""Options of those commands that mean something else here, or nothing."""

COMPUTING = ("encode", "decode", "render")
"""Those that --threads means something to."""

ENDINGS = {"encode": ".mcap", "validate": ".json", "render": ".mp4"}
FORMAT_ENDINGS = {"mosaic": ".mp4", "mcap": ".mcap"}
"""Of decode's outputs, by --format; the others are folders."""

DEFAULT_SEGMENT = 10.0


class SomeFailed(MvCodecError):
    """Not every recording came to its end."""


class _Keep(argparse.Action):
    """Keeps an option as it was given."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002 - as argparse calls it
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        given = [values] if isinstance(values, str) else list(values or ())
        namespace.options = [*namespace.options, (option_string, *given)]


def _forward(parser: argparse.ArgumentParser, command: str) -> None:
    """Take the options of a command, to be handed on as they are; its positional arguments stay behind."""
    theirs = argparse.ArgumentParser(add_help=False)
    import_module(f"mvcodec.cli.{command}").add_arguments(theirs)
    for action in theirs._actions:
        if action.option_strings and not set(action.option_strings) & set(OWN):
            choices = None if action.choices is None else "|".join(map(str, action.choices))
            parser.add_argument(
                *action.option_strings,
                action=_Keep,
                dest="options",
                default=argparse.SUPPRESS,
                nargs=action.nargs,
                metavar=action.metavar or choices,
                help=((action.help or "") % {**vars(action), "prog": f"mvcodec {command}"}).replace(
                    "%", "%%"
                ),
            )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``batch``."""
    commands = parser.add_subparsers(dest="what", required=True, metavar="|".join(PURPOSES))
    for name, purpose in PURPOSES.items():
        command = commands.add_parser(name, help=purpose, description=purpose, allow_abbrev=False)
        command.set_defaults(options=[])
        command.add_argument(
            "input",
            nargs="+",
            metavar="INPUT|MANIFEST.csv|GLOB",
            help="paths, URLs that fsspec knows (s3://, gs://, http://), patterns of them, or a CSV file with"
            " the columns input and, where wanted, name",
        )
        command.add_argument("--output", required=True, metavar="DIR|URL", help="folder of the outputs")
        add_cluster(command, default="local")
        if name in SEGMENTED:
            held = f" (default: {DEFAULT_SEGMENT:g}s)" if name == "encode" else " (default: all)"
            command.add_argument(
                "--segment", type=_seconds, metavar="10s|all", help=f"time that one task takes on{held}"
            )
        if name == "render":
            command.add_argument(
                "--ending",
                default=".mp4",
                metavar=".mp4",
                help="of the outputs' names (default: %(default)s)",
            )
        command.add_argument("-y", "--overwrite", action="store_true", help="make outputs of other runs anew")
        command.add_argument("--quiet", action="store_true", help="no progress bar, no summary")
        command.add_argument(
            "--json", action="store_true", help="print what became of each recording as JSON"
        )
        if name in COMPUTING:
            note = ", of each task (default: local workers share the cores, others use all of theirs)"
            add_setting(command, WorkerSettings, "threads", metavar="N", left_open=True, note=note)
        _forward(command, name)


def run(arguments: argparse.Namespace) -> None:
    """Do what is missing; one recording that fails does not keep the others."""
    options: tuple[Option, ...] = tuple(arguments.options)
    _check_options(arguments.what, options)
    recordings = find_recordings(arguments.input)
    batch = Batch(
        arguments.what,
        options,
        _absolute(arguments.output),
        _ending(arguments, options),
        _segment(arguments),
        arguments.retries,
        arguments.overwrite,
        _threads(arguments),
    )
    _check_segment(batch)
    with (
        connected(arguments.cluster, arguments.retries) as client,
        progress(f"batch {batch.command}", 0, quiet=arguments.quiet, unit="frame set") as bar,
    ):

        def more(frames: int) -> None:
            bar.total = (bar.total or 0) + frames
            bar.refresh()

        jobs = run_batch(client, batch, recordings, Progress(more, bar.update))
    _report(jobs, arguments)


def _check_options(command: str, options: Sequence[Option]) -> None:
    """Let the command's own parser judge its options, before anything is sent away."""
    from mvcodec.cli.main import OneLineParser

    parser = OneLineParser(prog=f"mvcodec batch {command}", allow_abbrev=False)
    import_module(f"mvcodec.cli.{command}").add_arguments(parser)
    places = ["in.mcap"] if command == "validate" else ["in.mcap", "out"]
    tokens = [token for option in options for token in option]
    parser.parse_args([*places, *join_negative_values(tokens)])


def _report(jobs: Sequence[Job], arguments: argparse.Namespace) -> None:
    failed = [job for job in jobs if job.error is not None]
    if arguments.json:
        print(json.dumps([_document(job) for job in jobs]))
    for job in failed:
        warnings.warn(f"{job.recording.source}: {job.error}", MvCodecWarning, stacklevel=2)
    done = sum(job.error is None and not job.skipped for job in jobs)
    there = len(jobs) - done - len(failed)
    if not arguments.quiet and not arguments.json:
        before = f", {there} there before" if there else ""
        print(f"{arguments.output}: {count(done, 'recording')} done{before}")
    if failed:
        raise SomeFailed(
            f"{len(failed)} of {count(len(jobs), 'recording')} failed; the same command tries again"
        )


def _document(job: Job) -> dict[str, Any]:
    state = "failed" if job.error is not None else "there before" if job.skipped else "done"
    return {
        "input": job.recording.source,
        "output": job.target.url,
        "state": state,
        "error": job.error,
        "result": job.result,
    }


def _absolute(output: str) -> Place:
    place = Place(output)
    return place if place.local is None else Place(str(place.local.resolve()))


def _ending(arguments: argparse.Namespace, options: Sequence[Option]) -> str:
    if arguments.what == "render":
        return str(arguments.ending)
    if arguments.what in ENDINGS:
        return ENDINGS[arguments.what]
    form = {option[0]: option[-1] for option in options}.get("--format")
    return FORMAT_ENDINGS.get(form or "", "")


def _segment(arguments: argparse.Namespace) -> float | None:
    given: float | None = getattr(arguments, "segment", None)
    if given is None:
        return DEFAULT_SEGMENT if arguments.what == "encode" else None
    return None if given == float("inf") else given


def _check_segment(batch: Batch) -> None:
    names = [option[0] for option in batch.options]
    if batch.segment_s is None or batch.command != "decode":
        return
    if batch.ending:
        raise SettingError("--segment", f"with one {batch.ending} file", "--format array or png: folders")
    if "--frames" in names:
        raise SettingError("--segment", "with --frames", "one of the two")


def _threads(arguments: argparse.Namespace) -> int | None:
    given: int | None = getattr(arguments, "threads", None)
    workers = local_workers(arguments.cluster)
    if given is not None or workers is None or arguments.what not in COMPUTING:
        return given
    return max(thread_count() // workers, 1)


def _seconds(text: str) -> float:
    match = re.fullmatch(r"(\d{1,6}(?:\.\d{1,6})?)(s|min)?", text)
    if text == "all":
        return float("inf")
    if match is None or float(match[1]) == 0:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a length such as 10s or 2min, or all")
    return float(match[1]) * (60 if match[2] == "min" else 1)
