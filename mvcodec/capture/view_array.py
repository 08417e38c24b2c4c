"""An array of views, each a sequence of picture files or a video file, read side by side."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from mvcodec.array import CameraArray, Position
from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.given_maps import GivenFiles, GivenOfFrame
from mvcodec.capture.pairing import Pairing
from mvcodec.capture.picture_files import look_at_depth, picture_facts, read_picture, wrong_size
from mvcodec.capture.reading import OnUnreadable
from mvcodec.capture.source import resolve_frames
from mvcodec.capture.truth import TruthFiles
from mvcodec.errors import InputError, SettingError
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.workers import Job, settle, submit


class ViewReader(Protocol):
    """The pictures of one view. `path` names it in messages; `size` is (width, height) px."""

    @property
    def path(self) -> Path: ...

    @property
    def size(self) -> tuple[int, int]: ...

    @property
    def count(self) -> int: ...

    @property
    def times_ns(self) -> tuple[int, ...] | None:
        """When the pictures were taken, ascending; None where nothing says so."""
        ...

    @property
    def early(self) -> int:
        """Pictures that the file has before the first whole one, where it has no times."""
        ...

    @property
    def fps(self) -> float:
        """Pictures a second, as the file says; 0 where nothing does."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What is unusual about the files, one line each."""
        ...

    def readable(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """uint8 (H, W, 3) RGB of the frames of these numbers, which ascend, read as they are asked for.

        Args:
            on_unreadable: told of those that cannot be read, which are None; None: that is raised.
        """
        ...


class PictureView:
    """A view whose frames are picture files.

    Args:
        depth: of the whole input.

    Raises:
        InputError: the first one is missing or unreadable.
    """

    def __init__(self, paths: tuple[Path, ...], depth: BitDepth) -> None:
        self._paths, self._depth = paths, depth
        self.path = paths[0]
        self.count = len(paths)
        self.times_ns: tuple[int, ...] | None = None
        self.early, self.fps = 0, 0.0
        facts = picture_facts(paths[0])
        self.size = facts.size
        self.notes: tuple[str, ...] = ("how opaque its pixels are is left out",) if facts.alpha else ()
        if facts.count > 1:
            several = f"it holds {facts.count} pictures: the first one is taken; make a video of an animation"
            self.notes += (several,)
        if facts.bits > 8:
            look_at_depth(paths[0], depth)

    def readable(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """See ViewReader; every picture must have the size of the first one."""
        for frame in frames:
            try:
                picture = read_picture(self._paths[frame], self.size, self._depth)
            except InputError as error:
                if on_unreadable is None:
                    raise
                on_unreadable(error)
                yield None
            else:
                yield picture


class ViewArray:
    """An ArraySource over view readers.

    Args:
        name: the input as the user wrote it.
        array: geometry and real cameras.
        views: a reader for every grid position, all of the same size (see `check_sizes`).
        pairing: which of their pictures belong together; views that it leaves out cannot be read.
        on_unreadable: told of a picture that cannot be read, whose frame set is left out; None: it is raised.
        truth: ground truth by view.
        given: disparity or depth of the views' pictures; None: there is none.
        first_frame, listed_real: as in ArraySource.
    """

    def __init__(
        self,
        name: str,
        array: CameraArray,
        views: Mapping[Position, ViewReader],
        pairing: Pairing,
        *,
        on_unreadable: OnUnreadable | None = None,
        truth: Mapping[Position, TruthFiles] | None = None,
        given: GivenFiles | None = None,
        first_frame: int = 0,
        listed_real: tuple[Position, ...] | None = None,
    ) -> None:
        self.name, self.array = name, array
        self.first_frame, self.listed_real = first_frame, listed_real
        self.frame_count = len(pairing.times_ns)
        self._views, self._pairing, self._truth = views, pairing, dict(truth or {})
        self._on_unreadable, self._given = on_unreadable, given
        self.has_given = given is not None

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """See ArraySource. The next frame set is read while the caller works on this one."""
        numbers = resolve_frames(frames, self.frame_count, self.name)
        chosen = self.array.real if views is None else tuple(views)
        for position in chosen:
            if position not in self._pairing.numbers:
                grid = f"a view of the {self.array.rows}x{self.array.cols} grid"
                if position in self._views:
                    grid = "a real camera: the input was opened without `originals`"
                raise SettingError("views", f"{position[0]},{position[1]}", grid)
        return self._read(numbers, chosen)

    def _read(self, numbers: range, positions: tuple[Position, ...]) -> Iterator[FrameSet]:
        streams = {
            position: self._views[position].readable(
                [self._pairing.numbers[position][n] for n in numbers], self._on_unreadable
            )
            for position in positions
        }

        def start() -> dict[Position, Job[Picture | None]]:
            return {position: submit(next, stream) for position, stream in streams.items()}

        ahead = start()
        try:
            for number in numbers:
                # A view's pictures are read one after the other: its stream is finished with
                # this frame before it is asked for the next.
                settle(ahead.values())
                found = {position: job.result() for position, job in ahead.items()}
                if number + 1 in numbers:
                    ahead = start()
                pictures = {position: picture for position, picture in found.items() if picture is not None}
                if len(pictures) == len(found):
                    index, time_ns = self.first_frame + number, self._pairing.times_ns[number]
                    yield FrameSet(index, time_ns, pictures, self._given_of(number, positions))
        finally:
            for job in ahead.values():
                job.cancel()
            settle(ahead.values())

    def _given_of(self, number: int, positions: tuple[Position, ...]) -> Mapping[Position, DisparityMap]:
        if self._given is None:
            return {}
        numbers = {view: self._pairing.numbers[view][number] for view in positions}
        return GivenOfFrame(self._given, numbers, self.array)

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        """See ArraySource."""
        files = self._truth.get(view)
        if files is None:
            return None
        return files.read(self._pairing.numbers[view][frame], (self.array.width, self.array.height))


def check_sizes(views: Mapping[Position, ViewReader]) -> None:
    """All views must have the size of the first one.

    Raises:
        InputError: naming the first file that differs, and both values.
    """
    first = views[0, 0]
    for view in views.values():
        if view.size != first.size:
            raise wrong_size(view.path, view.size, first.size)
