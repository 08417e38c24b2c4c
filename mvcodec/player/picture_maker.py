"""Requests in, JPEG pictures out, with what it cost and what must be said about them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from mvcodec.array import Position, Viewpoint
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.decoding.frame_store import Damage, FrameStore, StoredFrame
from mvcodec.errors import StreamError
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.player import overlays
from mvcodec.player.ahead import move_ahead
from mvcodec.player.draft import QUICKER, SMALLER, Level, in_full_px, shrink
from mvcodec.player.focus import lens_around, through_lens
from mvcodec.player.looks import COMPARING, EYES, LOOKS, Legend
from mvcodec.player.originals import Originals
from mvcodec.player.session import Enhanced, PictureRequest
from mvcodec.player.synthesizer_pool import SynthesizerPool
from mvcodec.player.thumbnails import Thumbnails
from mvcodec.synthesis.synthesizer import Preparing, Synthesizer
from mvcodec.synthesis.towards_enhanced import TowardsEnhanced, views_near
from mvcodec.workers import thread_count

MOST_AT_ONCE = 2
"""More pictures would wait for each other: each is made by all threads of the process."""

JPEG_QUALITY = 90


@dataclass(frozen=True, slots=True)
class MadePicture:
    """A picture and its facts.

    Attributes:
        jpeg: the coded picture.
        facts: plain JSON values: what is shown, what it cost in ms, legend, damage, quality.
        drawing_s: seconds of rendering and coding; what else it took was waiting for the frame set.
        damaged: it stands in for a frame that cannot be decoded.
        view: what it shows, where that is one view.
    """

    jpeg: bytes
    facts: dict[str, Any]
    drawing_s: float
    damaged: bool
    view: RenderedView | None = None


class PictureMaker:
    """Makes pictures of one file, `at_once` of them.

    Args:
        path: the file.
        make_synthesizer: makes one synthesizer.
        make_quick: makes one for pictures that move, if there is a quicker one.
        limits: a file that needs more is refused.
        matcher: name of what estimates the maps of a file that holds none; by default as the file says.

    Attributes:
        store: the file's frame sets.
        thumbnails: small pictures of the file.
        at_once: how many pictures may be asked for at the same time.
        levels: at which pictures can be made.
        originals: to measure against; None at first.

    Raises:
        InputError, StreamError: as `FrameStore`.
    """

    def __init__(
        self,
        path: Path,
        make_synthesizer: Callable[[], Synthesizer],
        make_quick: Callable[[], Synthesizer] | None = None,
        limits: Limits = DEFAULT_LIMITS,
        matcher: str | None = None,
    ) -> None:
        self.store = FrameStore(path, limits=limits, matcher=matcher)
        self.thumbnails = Thumbnails(path, limits)
        self.originals: Originals | None = None
        self.at_once = min(thread_count(), MOST_AT_ONCE)
        self.levels = SMALLER if make_quick is None else QUICKER
        self._synthesizers = SynthesizerPool(make_synthesizer, self.at_once + 1)
        self._quick = SynthesizerPool(make_quick or make_synthesizer, self.at_once + 1)
        self._drafts = _Drafts()
        self._ahead = ThreadPoolExecutor(1, "ahead")
        self._coming: tuple[int, Future[None]] | None = None

    def make(self, request: PictureRequest, upcoming: Sequence[int] = ()) -> MadePicture:
        """Decode, render, compose and code one picture.

        Args:
            upcoming: frames that are decoded meanwhile; the first, which is expected next, is prepared too.

        Raises:
            StreamError: no frame of the file can be decoded.
            InputError: the original's picture cannot be read.
        """
        self._wait_for(request.frame)
        stored = self._fetch(request)
        if stored.decoded is None:
            found = stored.damage.message if stored.damage else "no frame"
            raise StreamError(Path(self.store.name).name, found, "a frame that can be decoded")
        if upcoming:
            self._begin(replace(request, frame=upcoming[0]), upcoming[1:])
        start = time.perf_counter()
        decoded = self._drafts.of(stored.decoded, request.level.scale)
        views = self._render(decoded, self._viewpoints(request), self._level(request))
        if request.dolly > 0:
            array, range_px = stored.decoded.array, stored.decoded.disparity_range_px
            views = [move_ahead(view, array, range_px, request.dolly) for view in views]
        rendered = time.perf_counter()
        shown = replace(decoded, disparity_range_px=stored.decoded.disparity_range_px)
        original = self._original(request, decoded)
        pictures, legend = _composed(request, shown, views, original)
        if request.focus_px is None:
            picture = EYES[request.eyes].combine(pictures)
        else:
            low, high = decoded.disparity_range_px
            focus_px = min(max(request.focus_px * request.level.scale, low), high)
            seen = [replace(view, pixels=one) for view, one in zip(views, pictures, strict=True)]
            picture = through_lens(decoded, seen, request.viewpoint, focus_px)
        jpeg = to_jpeg(picture)
        done = time.perf_counter()
        facts = {
            "frame": request.frame,
            "index": decoded.index,
            "time_s": self.store.table.times_ns[request.frame] / 1e9,
            "row": request.viewpoint.row,
            "col": request.viewpoint.col,
            "dolly": request.dolly,
            "wipe": request.wipe,
            "look": request.look,
            "eyes": request.eyes,
            "eye_steps": request.eye_steps,
            "focus_px": request.focus_px,
            "scale": request.level.scale,
            "quick": request.level.quick,
            "enhanced": bool(self._near(request) & decoded.enhanced.keys()),
            "legend": legend or None,
            "decode_ms": round(stored.decode_ms, 2),
            "synthesis_ms": round(1000 * (rendered - start), 2),
            "encode_ms": round(1000 * (done - rendered), 2),
            "damage": stored.damage and self._describe(stored.damage),
            "quality": self._measure(request, decoded, views),
        }
        view = views[0] if len(views) == 1 else None
        return MadePicture(jpeg, facts, done - start, stored.damage is not None, view)

    def close(self) -> None:
        """Let go of the file; waits for pictures being made ahead."""
        self._ahead.shutdown(cancel_futures=True)
        self.thumbnails.close()
        self.store.close()

    def _viewpoints(self, request: PictureRequest) -> tuple[Viewpoint, ...]:
        array = self.store.table.header.array
        if request.focus_px is not None:
            return lens_around(array, request.viewpoint)
        return EYES[request.eyes].place(array, request.viewpoint, request.eye_steps)

    def _level(self, request: PictureRequest) -> Level:
        """As asked for; an average of many views is drawn quickly, which it hides."""
        hasty = request.focus_px is not None and self.levels is QUICKER
        return replace(request.level, quick=True) if hasty else request.level

    def _near(self, request: PictureRequest) -> frozenset[Position]:
        """The views that have a share in a picture if they are enhanced."""
        return views_near(self.store.table.header.array, self._viewpoints(request))

    def _fetch(self, request: PictureRequest) -> StoredFrame:
        if request.enhanced is Enhanced.ALL:
            return self.store.finish(request.frame, self._near(request))
        joins = request.enhanced is Enhanced.FROM_KEYFRAMES
        return self.store.fetch(request.frame, self._near(request) if joins else ())

    def _render(
        self, decoded: DecodedSet, viewpoints: tuple[Viewpoint, ...], level: Level
    ) -> list[RenderedView]:
        with self._pool_of(level).borrow(decoded) as synthesizer:
            shown = TowardsEnhanced(synthesizer)
            views = [shown.render(decoded, viewpoint) for viewpoint in viewpoints]
        return [in_full_px(view, level.scale) for view in views]

    def _pool_of(self, level: Level) -> SynthesizerPool:
        return self._quick if level.quick else self._synthesizers

    def _begin(self, request: PictureRequest, later: Sequence[int]) -> None:
        # One at a time: with many viewers it is a help to none if it queues up.
        if self._coming is None or self._coming[1].done():
            self._coming = request.frame, self._ahead.submit(self._prepare, request)
            for frame in later:
                self._ahead.submit(self._fetch, replace(request, frame=frame))

    def _prepare(self, request: PictureRequest) -> None:
        """Decode a frame set and prepare it for views from about the viewpoint."""
        stored = self._fetch(request)
        if stored.decoded is None:
            return
        decoded = self._drafts.of(stored.decoded, request.level.scale)
        with self._pool_of(request.level).borrow(decoded) as synthesizer:
            if isinstance(synthesizer, Preparing):
                synthesizer.prepare(decoded, request.viewpoint)

    def _wait_for(self, frame: int) -> None:
        """Until the frame is prepared, if it is being prepared: else it would be done twice."""
        coming = self._coming
        if coming is not None and coming[0] == frame:
            wait([coming[1]])

    def _measure(
        self, request: PictureRequest, decoded: DecodedSet, views: list[RenderedView]
    ) -> dict[str, Any] | None:
        if self.originals is None or request.look != COMPARING:
            return None
        return asdict(self.originals.measure(decoded, views[0]))

    def _original(self, request: PictureRequest, decoded: DecodedSet) -> Picture | None:
        """What the look `difference` compares with; None where there is nothing."""
        place = request.viewpoint.position
        if request.look != COMPARING or self.originals is None or place is None:
            return None
        return self.originals.picture(decoded.index, place)

    def _describe(self, damage: Damage) -> dict[str, Any]:
        times, goes_on = self.store.table.times_ns, damage.end < self.store.table.count
        return {
            "first": damage.first,
            "end": damage.end,
            "time_s": times[damage.first] / 1e9,
            "goes_on_s": times[damage.end] / 1e9 if goes_on else None,
            "message": damage.message,
        }


def _composed(
    request: PictureRequest, decoded: DecodedSet, views: Sequence[RenderedView], original: Picture | None
) -> tuple[list[Picture], Legend]:
    """Each view as its look shows it, left of the wipe the picture itself; and the first one's legend."""
    pictures, legends = [], []
    for view in views:
        if original is None:
            picture, legend = LOOKS[request.look](decoded, view)
        else:
            picture, legend = overlays.difference(view, original)
        left = round(request.wipe * picture.shape[1])
        pictures.append(np.hstack([view.pixels[:, :left], picture[:, left:]]))
        legends.append(legend)
    return pictures, legends[0]


class _Drafts:
    """The frame sets shrunk last; synthesizers know by identity what they have prepared."""

    def __init__(self) -> None:
        self._held: deque[tuple[DecodedSet, float, DecodedSet]] = deque(maxlen=MOST_AT_ONCE + 2)
        self._lock = threading.Lock()

    def of(self, decoded: DecodedSet, scale: float) -> DecodedSet:
        if scale == 1:
            return decoded
        with self._lock:
            for whole, held_scale, draft in self._held:
                if whole is decoded and held_scale == scale:
                    return draft
            draft = shrink(decoded, scale)
            self._held.append((decoded, scale, draft))
        return draft


def to_jpeg(picture: Picture) -> bytes:
    """Code a picture as JPEG, quality JPEG_QUALITY."""
    # Full chroma: overlays and anaglyphs live by their colours.
    options = [
        cv2.IMWRITE_JPEG_QUALITY,
        JPEG_QUALITY,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]
    _, data = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), options)
    return data.tobytes()
