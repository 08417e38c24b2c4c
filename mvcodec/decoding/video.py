"""`mvcodec.open`: a file of ours as a sequence of frame sets, and views of them from anywhere."""

from __future__ import annotations

import html
import os
import sys
import threading
import warnings
from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, overload

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.closing import Closing
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.remote import is_url
from mvcodec.container.shared_file import SharedFile
from mvcodec.decoding.decoder import ON_ERROR, Decoder, OnError
from mvcodec.decoding.frame_store import CACHE_BYTES, FrameStore
from mvcodec.errors import InputError, MvCodecWarning, NoSuchFrame
from mvcodec.frames import DecodedSet, FloatMap, Picture, RenderedView
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.provenance import Provenance
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import DEFAULT_SYNTHESIZER, make_synthesizer
from mvcodec.synthesis.towards_enhanced import TowardsEnhanced, views_near
from mvcodec.web_player.pages import shown_in_frame, single_page

STANDARD_INPUT = "-"
NOTEBOOK_BYTES = 64 << 20
"""A notebook keeps what its cells show: larger files are not put into it."""

KEPT_VIEWS = 4
"""Rendered views that are kept, so that a picture, its disparity and its provenance cost one rendering."""


def open(
    source: str | os.PathLike[str] | BinaryIO,
    *,
    synthesizer: str | Synthesizer = DEFAULT_SYNTHESIZER,
    matcher: str | Matcher | None = None,
    on_error: OnError = "stop",
    cache_bytes: int = CACHE_BYTES,
    limits: Limits = DEFAULT_LIMITS,
    enhancement: bool = True,
) -> Video:
    """Open a file of ours, to be used as a context manager: ``with mvcodec.open("x.mcap") as video:``.

    Args:
        source: path, URL of a file on a web server, ``-`` for standard input, or a binary file, which stays
            open. What cannot be sought in (a pipe) can be iterated over, once; nothing else.
        synthesizer: what renders views: a specification such as ``dils:split=levels``, or one's own.
        matcher: what estimates the maps of a file that holds none; by default the one that the file names.
        on_error: at damage while iterating, ``stop``: raise; ``skip``: warn, and go on at the next keyframe.
        cache_bytes: decoded frame sets are kept up to this size (and at least three of them).
        limits: what is more than that is refused.
        enhancement: views on the places of enhanced ones are those, near to them partly; False: all views
            are made from the base alone, and frame sets are decoded without enhanced views anyway.

    Raises:
        InputError: there is no such file, or the system refuses to open it.
        StreamError: not an MCAP file, one without our header, or one of a newer format version.
        SettingError: an unknown synthesizer, or a setting of it outside its range.
    """
    return Video(source, synthesizer, matcher, on_error, cache_bytes, limits, enhancement)


class Video(Closing):
    """A file of frame sets, by number, by time or in order. Made by `mvcodec.open`.

    Numbers count the file's own frame sets from 0. All methods may be called from several threads: decoding
    is done by one of them at a time, and so is rendering with one synthesizer. What is returned must not be
    changed, since it may be returned again.
    """

    def __init__(
        self,
        source: str | os.PathLike[str] | BinaryIO,
        synthesizer: str | Synthesizer,
        matcher: str | Matcher | None,
        on_error: OnError,
        cache_bytes: int,
        limits: Limits,
        enhancement: bool,
    ) -> None:
        ON_ERROR.check(on_error)
        self._enhancement = enhancement
        self._synthesizers = _Synthesizers(synthesizer)
        self._matcher, self._on_error, self._limits = matcher, on_error, limits
        file = sys.stdin.buffer if source == STANDARD_INPUT else source
        self._source: str | Path | SharedFile
        self._store: FrameStore | None = None
        self._pipe: Decoder | None = None
        if isinstance(file, str | os.PathLike):
            self._source = file if isinstance(file, str) else Path(file)
        elif not file.seekable():
            self._pipe = Decoder.open(file, None, on_error, limits, matcher)
            self._header, self._name = self._pipe.header, str(getattr(file, "name", "input"))
            return
        else:
            self._source = SharedFile(file)
        self._store = FrameStore(self._source, cache_bytes, limits, matcher)
        self._header, self._name = self._store.table.header, self._store.name
        if self._store.table.cut_off:
            text = f"{self._store.table.cut_off}; {len(self)} frame sets can be read"
            warnings.warn(text, MvCodecWarning, stacklevel=4)

    @property
    def header(self) -> StreamHeader:
        """All that the file says about itself, the encoder's settings among it."""
        return self._header

    @property
    def array(self) -> CameraArray:
        """The grid of views, the real cameras and their calibration."""
        return self._header.array

    @property
    def fps(self) -> float:
        """Frame sets a second, nominal; `times_s` has the real times."""
        return self._header.array.fps

    @property
    def codec(self) -> str:
        """Name of the video codec: ``h264``, ``hevc`` ..."""
        return self._header.codec

    @property
    def times_s(self) -> tuple[float, ...]:
        """When each frame set was taken, seconds after the first one.

        Raises:
            InputError: the source is a pipe.
        """
        times = self._stored.table.times_ns
        return tuple((time - times[0]) / 1e9 for time in times)

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame set to the end of the last one, which lasts 1 / fps.

        Raises:
            InputError: the source is a pipe.
        """
        return self.times_s[-1] + 1 / self.fps

    def __len__(self) -> int:
        """How many frame sets there are; InputError where the source is a pipe."""
        return self._stored.table.count

    @overload
    def __getitem__(self, number: int) -> DecodedSet: ...
    @overload
    def __getitem__(self, number: slice) -> Iterator[DecodedSet]: ...
    def __getitem__(self, number: int | slice) -> DecodedSet | Iterator[DecodedSet]:
        """Frame set `number`; negative ones count from the end. A slice is gone through one by one.

        Decoding starts at the keyframe before it, unless the frame set is at hand.

        Raises:
            NoSuchFrame: an IndexError: the file has no frame set of this number.
            StreamError: it is damaged, or builds on a damaged one; with topic and time.
            InputError: the source is a pipe.
        """
        if isinstance(number, slice):
            return (self[at] for at in range(*number.indices(len(self))))
        return self._fetch(number, frozenset())

    def _fetch(self, number: int, enhanced: frozenset[Position]) -> DecodedSet:
        store = self._stored
        count = store.table.count
        if not -count <= number < count:
            raise NoSuchFrame(self._name, f"frame {number}", f"0..{count - 1}, or -{count}..-1 from the end")
        found = store.finish(number % count, enhanced)
        if found.damage is not None:
            raise found.damage.error
        assert found.decoded is not None
        return found.decoded

    def at(self, seconds: float) -> DecodedSet:
        """The frame set that is shown at a time, in seconds after the first one.

        Raises:
            NoSuchFrame: an IndexError: a time before the first frame set or after the end.
            StreamError, InputError: as for ``video[number]``.
        """
        return self[self._number_at(seconds)]

    def __iter__(self) -> Iterator[DecodedSet]:
        """All frame sets in order, decoded one after the other and not kept.

        Raises:
            StreamError: damage, with topic and time, unless it is skipped.
            InputError: the source is a pipe that was gone through before.
        """
        if self._store is None:
            pipe, self._pipe = self._pipe, None
            if pipe is None:
                raise InputError(self._name, "a pipe that was gone through before", "a fresh one")
            with pipe:
                yield from pipe
            return
        source = self._source.reader() if isinstance(self._source, SharedFile) else self._source
        with Decoder.open(source, None, self._on_error, self._limits, self._matcher) as decoder:
            yield from decoder

    def view(
        self, row: float, col: float, *, frame: int = 0, synthesizer: str | Synthesizer | None = None
    ) -> RenderedView:
        """The view from a place on the plane of the cameras: picture, disparity, and who saw what.

        Args:
            row, col: in steps of the grid, 0..rows - 1 and 0..cols - 1; fractions are legal. On a real
                camera's place the picture is that camera's decoded one, exactly; so it is on an enhanced
                view's.
            frame: number of the frame set, as in ``video[frame]``.
            synthesizer: for this view; by default the one given to `mvcodec.open`.

        Raises:
            SettingError: a place outside of the array, or no such synthesizer.
            NoSuchFrame, StreamError, InputError: as for ``video[frame]``.
        """
        place = Viewpoint(row, col)
        self.array.check_viewpoint(place)
        near = views_near(self.array, [place]) if self._enhancement else frozenset()
        return self._synthesizers.render(self._fetch(frame, near), place, synthesizer)

    def render(
        self, row: float, col: float, *, frame: int = 0, synthesizer: str | Synthesizer | None = None
    ) -> Picture:
        """The picture of `view`: uint8 (H, W, 3) RGB. Arguments and errors as there."""
        return self.view(row, col, frame=frame, synthesizer=synthesizer).pixels

    def disparity(
        self, row: float, col: float, *, frame: int = 0, synthesizer: str | Synthesizer | None = None
    ) -> FloatMap:
        """The disparity of `view`: float32 (H, W), px between neighbouring real cameras; larger is nearer."""
        return self.view(row, col, frame=frame, synthesizer=synthesizer).disparity_px

    def provenance(
        self, row: float, col: float, *, frame: int = 0, synthesizer: str | Synthesizer | None = None
    ) -> Provenance:
        """Where the pixels of `view` come from: ``seen_by``, uint8 (H, W), how many real cameras saw each one
        (0: filled), and ``layers``, its depth layers."""
        return Provenance.of(self.view(row, col, frame=frame, synthesizer=synthesizer))

    def _repr_html_(self) -> str:
        """What a notebook shows: the player, with the file in it or behind its address."""
        source = self._source if self._store is not None else None
        if isinstance(source, str) and is_url(source):
            return shown_in_frame(single_page(self._name, source))
        if not isinstance(source, str | Path):
            return html.escape(f"{self._name}: no file on disk; mvcodec.open(path) shows a player")
        size = Path(source).stat().st_size
        if size > NOTEBOOK_BYTES:
            text = f"{self._name}: {size} bytes, too many for a notebook; mvcodec play {self._name} shows it"
            return html.escape(text)
        return shown_in_frame(single_page(self._name, Path(source).read_bytes()))

    def close(self) -> None:
        """Let go of the file. A binary file that was given stays open."""
        if self._pipe is not None:
            self._pipe.close()
        if self._store is not None:
            self._store.close()

    @property
    def _stored(self) -> FrameStore:
        if self._store is None:
            expected = "a file, for its length and for frames by number (a pipe can be iterated over, once)"
            raise InputError(self._name, "a pipe", expected)
        return self._store

    def _number_at(self, seconds: float) -> int:
        times = self._stored.table.times_ns
        if not 0 <= seconds <= self.duration_s:
            raise NoSuchFrame(self._name, f"time {seconds:g} s", f"0..{self.duration_s:g} s")
        return bisect_right(times, times[0] + round(seconds * 1e9)) - 1


class _Synthesizers:
    """Synthesizers by what was asked for, and the views that they rendered last."""

    def __init__(self, usual: str | Synthesizer) -> None:
        self._usual = usual
        self._made: dict[str, Synthesizer] = {}
        self._views: OrderedDict[tuple[int, int, Viewpoint], tuple[DecodedSet, RenderedView]] = OrderedDict()
        self._lock = threading.Lock()
        self._find(usual)  # a wrong name is told before anything is opened

    def render(self, decoded: DecodedSet, place: Viewpoint, asked: str | Synthesizer | None) -> RenderedView:
        with self._lock:
            renderer = self._find(self._usual if asked is None else asked)
            key = id(renderer), id(decoded), place
            # The set is kept with its view, so that no other one can get its id.
            held = self._views.pop(key, None) or (decoded, TowardsEnhanced(renderer).render(decoded, place))
            self._views[key] = held
            if len(self._views) > KEPT_VIEWS:
                self._views.popitem(last=False)
            return held[1]

    def _find(self, asked: str | Synthesizer) -> Synthesizer:
        if not isinstance(asked, str):
            return asked
        if asked not in self._made:
            self._made[asked] = make_synthesizer(asked)
        return self._made[asked]
