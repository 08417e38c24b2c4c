"""The browser player and the sample beside the documents' pages, for docs/player.md: a hook of MkDocs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from mkdocs.structure.files import File

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

ROOT = Path(__file__).parents[1]
BESIDE = (ROOT / "mvcodec" / "web_player" / "dist" / "player.js", ROOT / "samples" / "room_2x2.mcap")


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """What MkDocs calls with the files of a site before it is built."""
    for path in BESIDE:
        files.append(File.generated(config, path.name, abs_src_path=str(path)))
    return files
