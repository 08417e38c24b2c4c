"""``mvcodec plugins``: matchers, synthesizers and refinements, with their settings."""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Iterator
from typing import Any

from mvcodec.errors import MvCodecError, MvCodecWarning, SettingError
from mvcodec.layers.refinement import REFINEMENT_PLUGINS, SEPARATOR
from mvcodec.plugin_tables import Plugin, PluginTable
from mvcodec.settings import did_you_mean, show
from mvcodec.stereo.matchers import MATCHER_PLUGINS
from mvcodec.synthesis.synthesizers import SYNTHESIZER_PLUGINS

TABLES = (MATCHER_PLUGINS, REFINEMENT_PLUGINS, SYNTHESIZER_PLUGINS)
EXAMPLES = {
    "matcher": "--matcher joint:subpixel_steps=0",
    "refinement": f"behind a matcher: --matcher sad:window=9{SEPARATOR}dlr:erosion_px=3",
    "synthesizer": "--synthesizer dils:split=levels,rematch=sad:window=9/median_size=5",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``plugins``."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="one of them, with all its settings")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(arguments: argparse.Namespace) -> None:
    """List all, or one with its settings."""
    found = list(_documents(arguments.name))
    if arguments.name and not found:
        names = [name for table in TABLES for name, _ in table.sources()]
        expected = f"one of {', '.join(names)}{did_you_mean(arguments.name, names)}"
        raise SettingError("NAME", arguments.name, expected)
    if arguments.json:
        print(json.dumps(found))
    elif arguments.name:
        for document in found:
            _print_one(document)
    else:
        _print_all(found)


def _documents(wanted: str | None) -> Iterator[dict[str, Any]]:
    for table in TABLES:
        for name, source in table.sources():
            if wanted not in {None, name}:
                continue
            try:
                yield _document(table, name, source, table.load(name))
            except MvCodecError as error:
                if wanted:
                    raise
                warnings.warn(str(error), MvCodecWarning, stacklevel=2)


def _document(table: PluginTable, name: str, source: str, plugin: Plugin) -> dict[str, Any]:
    settings = [
        {
            "name": key,
            "type": known.type_name,
            "default": _plain(plugin.default(key)),
            "allowed": f"{known.allowed}, or none" if known.optional else known.allowed,
            "help": known.help,
        }
        for key, known in plugin.known.items()
    ]
    return {"kind": table.kind, "name": name, "source": source, "help": plugin.help, "settings": settings}


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool | int | float | str | None) else str(value)


def _print_all(documents: list[dict[str, Any]]) -> None:
    for kind, example in EXAMPLES.items():
        print(f"{kind}s ({example}):")
        for document in documents:
            if document["kind"] == kind:
                keys = ", ".join(setting["name"] for setting in document["settings"]) or "none"
                source = "" if document["source"] == "mvcodec" else f" [{document['source']}]"
                print(f"  {document['name']:11} {document['help']}{source}")
                print(f"  {'':11} settings: {keys}")


def _print_one(document: dict[str, Any]) -> None:
    print(f"{document['name']}: {document['kind']} of {document['source']}: {document['help']}")
    for setting in document["settings"]:
        print(f"  {setting['name']}={show(setting['default'])}")
        print(f"      {setting['help']}; {setting['allowed']}")
