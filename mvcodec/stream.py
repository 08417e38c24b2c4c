"""What crosses the wire: packets of tracks, and the header that explains them (see FORMAT.md)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

from mvcodec.array import MAX_GRID_SIDE, MAX_PICTURE_SIDE, Calibration, CameraArray, Position
from mvcodec.errors import SettingError, StreamError
from mvcodec.fields import Fields

FORMAT_VERSIONS = (1, 2)
"""The versions that are read. Written is the lowest that holds all that a decoder must know."""

DISPARITY_SCALES = (1, 2)
"""Pixels of a picture, each way, for one sample of its map."""

DISPARITY_CAMERAS = ("all", "alternate", "none")
"""Which real cameras send a map: every one; every second one, as the white fields of a chess board; none,
so that the decoder estimates all maps from the decoded pictures."""


DISPARITY_USES = ("all", "prediction")
"""What maps that are sent are for: for all, or for predicting pictures alone, so that the decoder estimates
what it renders with."""


class TrackKind(StrEnum):
    """What a track carries."""

    HEADER = "header"
    TEXTURE = "video"
    DISPARITY = "disparity"
    PREDICTED = "predicted"
    """A camera's pictures, each coded from its own past and a prediction made from other cameras."""
    LAYER = "enhancement"
    """The header of the enhancement layer, see `mvcodec.enhancement`."""
    ENHANCED = "enhanced"
    """A virtual view's pictures, each coded from its own past and its synthesis."""
    DEPTH = "depth"
    """Metric depth for other people's tools; decoders have no use for it."""


@dataclass(frozen=True, slots=True)
class Track:
    """One stream of packets: the header's, or a real camera's pictures or disparity maps.

    Attributes:
        topic: of this track in the container, e.g. ``/camera/r00_c04/video``.
    """

    kind: TrackKind
    camera: Position | None = None
    topic: str = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        topic = f"/mvcodec/{self.kind.value}"
        if self.camera is not None:
            root = "view" if self.kind is TrackKind.ENHANCED else "camera"
            topic = f"/{root}/{view_name(self.camera)}/{self.kind.value}"
        object.__setattr__(self, "topic", topic)  # asked for with every packet


MAX_SEQUENCE = (1 << 32) - 1
"""MCAP's sequence has 32 bits."""

PREDICTIONS = ("none", "synthesis")
"""How real cameras are coded: each for itself, or from each other."""

PREDICTORS = ("warp-1", "warp-2")
"""The ways of predicting pictures that there are; another one gets another name. Encoders write the last one,
whose predictions may have a share of a track's past (`mvcodec.video.past`)."""

REFERENCE_CODECS = {"none": "vp9", "nearest": "vp9+nearest"}
"""Names of how predicted pictures are coded, by the second picture that each may build on beside its own past
and its prediction: none, or the nearest of its references as it was decoded."""

_CALIBRATION = ("fx_px", "fy_px", "cx_px", "cy_px", "baseline_m", "d_inf_px_per_step")

HEADER_TRACK = Track(TrackKind.HEADER)


@dataclass(frozen=True, slots=True)
class Packet:
    """One coded unit: an access unit of a video track, or a header as UTF-8 JSON.

    Attributes:
        index: frame number in the input.
        time_ns: capture time, integer nanoseconds.
        keyframe: decoding of the track can start here.
    """

    track: Track
    index: int
    time_ns: int
    keyframe: bool
    data: bytes


@dataclass(frozen=True, slots=True)
class PredictedCamera:
    """A real camera whose pictures are predicted from others.

    Attributes:
        references: those others; each is real, and plays alone or is predicted before this one.
    """

    camera: Position
    references: tuple[Position, ...]


@dataclass(frozen=True, slots=True)
class StreamHeader:
    """Everything that a receiver must know; sent as a packet with each keyframe.

    Attributes:
        array: geometry, real cameras, calibration.
        disparity_range_px: (lo, hi); code value 0 means lo, 255 means hi (linear).
        codec: name of the video codec of all tracks.
        first_frame: index in the input of the first coded frame.
        settings: the encoder's settings, for the record (names and plain JSON values).
        disparity_scale: 1 or 2: the maps are coded at the pictures' size, or at half of it each way.
        disparity_cameras: one of DISPARITY_CAMERAS.
        predicted: the real cameras that are predicted from others, in the order of decoding.
        disparity_use: one of DISPARITY_USES.
        second_reference: one of REFERENCE_CODECS, of the predicted cameras.
        predictor: one of PREDICTORS, of the predicted cameras.
    """

    array: CameraArray
    disparity_range_px: tuple[float, float]
    codec: str = "h264"
    first_frame: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    disparity_scale: int = 1
    disparity_cameras: str = "all"
    predicted: tuple[PredictedCamera, ...] = ()
    disparity_use: str = "all"
    second_reference: str = "none"
    predictor: str = PREDICTORS[-1]

    def __post_init__(self) -> None:
        low, high = self.disparity_range_px
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise SettingError("disparity_range_px", [low, high], "lo < hi")
        if self.disparity_scale not in DISPARITY_SCALES:
            expected = " or ".join(map(str, DISPARITY_SCALES))
            raise SettingError("disparity_scale", self.disparity_scale, expected)
        if self.disparity_cameras not in DISPARITY_CAMERAS:
            raise SettingError("disparity_cameras", self.disparity_cameras, " or ".join(DISPARITY_CAMERAS))
        if self.disparity_use not in DISPARITY_USES:
            raise SettingError("disparity_use", self.disparity_use, " or ".join(DISPARITY_USES))
        if self.disparity_use == "prediction" and not self.map_cameras:
            raise SettingError("disparity_use", self.disparity_use, "all where no camera sends a map")
        self._check_predicted()

    def _check_predicted(self) -> None:
        """Each prediction needs pictures that are there before it, and maps."""
        decoded = set(self.array.real) - {each.camera for each in self.predicted}
        if self.predicted and not self.map_cameras:
            raise SettingError("prediction.cameras", "some", "none where no camera sends a map")
        for each in self.predicted:
            if each.camera not in self.array.real or each.camera in decoded:
                raise SettingError("prediction.cameras", list(each.camera), "real cameras, each once")
            if not each.references or not decoded.issuperset(each.references):
                found = f"{list(each.camera)} from {[list(other) for other in each.references]}"
                raise SettingError("prediction.cameras", found, "real cameras that are decoded before")
            decoded.add(each.camera)

    @property
    def version(self) -> int:
        """The lowest format version that can say this."""
        return 2 if self.estimates_maps or self.predicted else 1

    @property
    def estimates_maps(self) -> bool:
        """Whether the decoder estimates the maps that it renders with."""
        return self.disparity_cameras == "none" or self.disparity_use == "prediction"

    @property
    def coding_error(self) -> tuple[float, float] | None:
        """What coding leaves in the real cameras' pictures, as the settings say it; None: they don't.

        Mean squared error of luma, grey levels squared, in keyframes and in other frame sets.
        """
        match self.settings.get("coding_error"):
            case [int() | float() as keyframes, int() | float() as others]:
                known = all(0 <= each < math.inf for each in (keyframes, others))
                return (float(keyframes), float(others)) if known else None
        return None

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The video tracks: pictures of every real camera, then the maps."""
        pictures = (self.picture_track(camera) for camera in self.array.real)
        maps = (Track(TrackKind.DISPARITY, camera) for camera in self.map_cameras)
        return (*pictures, *maps)

    def picture_track(self, camera: Position) -> Track:
        """The track of a real camera's pictures."""
        predicted = any(each.camera == camera for each in self.predicted)
        return Track(TrackKind.PREDICTED if predicted else TrackKind.TEXTURE, camera)

    def maps_around(self, place: Position) -> tuple[Position, ...]:
        """Whose maps say what is at a place: its own, if it sends one, else those within a cell."""
        senders = self.map_cameras
        if place in senders:
            return (place,)
        down, across = self.array.row_step, self.array.col_step
        return tuple(
            (row, col)
            for row, col in senders
            if abs(row - place[0]) <= down and abs(col - place[1]) <= across
        )

    def needed_tracks(self, predicted: PredictedCamera) -> set[Track]:
        """What must be decoded before a camera can be predicted."""
        pictures = {self.picture_track(camera) for camera in predicted.references}
        return pictures | self.needed_maps(predicted.camera, predicted.references)

    def needed_maps(self, place: Position, references: Sequence[Position]) -> set[Track]:
        """The maps, and what they need, for predicting a place from references."""
        places = (place, *references)
        maps = {camera for place in places for camera in self.maps_around(place)}
        # Half-size maps are enlarged along the edges of their cameras' pictures, if these play alone.
        alone = {track for track in map(self.picture_track, maps) if track.kind is TrackKind.TEXTURE}
        return alone | {Track(TrackKind.DISPARITY, camera) for camera in maps}

    @property
    def map_cameras(self) -> tuple[Position, ...]:
        """The real cameras that send a map."""
        return map_cameras(self.array, self.disparity_cameras)

    def to_json(self) -> bytes:
        """UTF-8 JSON as FORMAT.md specifies it."""
        array = asdict(self.array)
        document = {
            "format": "mvcodec",
            "version": self.version,
            "codec": self.codec,
            "array": array,
            "disparity_range_px": list(self.disparity_range_px),
            "disparity_scale": self.disparity_scale,
            "disparity_cameras": self.disparity_cameras,
            "first_frame": self.first_frame,
            "settings": dict(self.settings),
        }
        if self.disparity_use != "all":
            document["disparity_use"] = self.disparity_use
        if self.predicted:
            cameras = [{"camera": each.camera, "from": each.references} for each in self.predicted]
            codec = REFERENCE_CODECS[self.second_reference]
            document["prediction"] = {"predictor": self.predictor, "codec": codec, "cameras": cameras}
        return json.dumps(document, separators=(",", ":")).encode()

    @classmethod
    def from_json(cls, data: bytes, source: str = "header") -> StreamHeader:
        """Parse what `to_json` wrote.

        Raises:
            StreamError: not a header, a damaged one, or one of a newer format version.
        """
        try:
            document = json.loads(data)
        except (ValueError, RecursionError) as error:
            raise StreamError(source, f"a header that is not JSON ({error})", "mvcodec's header") from None
        if not isinstance(document, dict) or document.get("format") != "mvcodec":
            raise StreamError(source, "a header of another format", "mvcodec's header")
        version = document.get("version")
        if version not in FORMAT_VERSIONS:
            expected = " or ".join(map(str, FORMAT_VERSIONS))
            raise StreamError(source, f"format version {version}", f"version {expected}")
        try:
            header = cls._from_fields(Fields(source, document, error=StreamError))
        except SettingError as error:
            raise StreamError(source, f"a damaged header ({error})", "the fields of FORMAT.md") from None
        if header.version > version:
            no_maps = "disparity_cameras none" if not header.map_cameras else "disparity_use prediction"
            what = "predicted cameras" if header.predicted else no_maps
            found = f"{what} in a header of version {version}"
            raise StreamError(source, found, f"version {header.version}")
        return header

    @classmethod
    def _from_fields(cls, fields: Fields) -> StreamHeader:
        predicted = fields.inner("prediction") if "prediction" in fields else None
        return cls(
            array=_array(fields.inner("array")),
            disparity_range_px=fields.pair("disparity_range_px"),
            codec=fields.text("codec"),
            first_frame=fields.integer("first_frame", 0, MAX_SEQUENCE),
            settings=fields.inner("settings").values,
            disparity_scale=fields.integer("disparity_scale", 1, DISPARITY_SCALES[-1], 1),
            disparity_cameras=fields.text("disparity_cameras", "all"),
            predicted=() if predicted is None else _predicted(predicted),
            second_reference="none" if predicted is None else _second_reference(predicted),
            predictor=PREDICTORS[-1] if predicted is None else _predictor(predicted),
            disparity_use=fields.text("disparity_use", "all"),
        )


def _predictor(fields: Fields) -> str:
    found = fields.text("predictor")
    if found not in PREDICTORS:
        raise fields.wrong("predictor", found, " or ".join(PREDICTORS))
    return found


def _predicted(fields: Fields) -> tuple[PredictedCamera, ...]:
    """The header's `prediction`."""
    cameras = fields.get("cameras", "a list")
    try:
        return tuple(
            PredictedCamera(_position(each["camera"]), tuple(_position(other) for other in each["from"]))
            for each in cameras
        )
    except (TypeError, KeyError, ValueError):
        expected = '[{"camera": [row, col], "from": [[row, col], ...]}, ...]'
        raise fields.wrong("cameras", cameras, expected) from None


def _second_reference(fields: Fields) -> str:
    """What the codec of the header's `prediction` says."""
    codec = fields.text("codec")
    found = second_reference_of(codec)
    if found is None:
        raise fields.wrong("codec", codec, " or ".join(REFERENCE_CODECS.values()))
    return found


def second_reference_of(codec: str) -> str | None:
    """Which of REFERENCE_CODECS a name stands for, if one."""
    return next((name for name, known in REFERENCE_CODECS.items() if known == codec), None)


def _position(value: Any) -> Position:
    row, col = value
    if type(row) is not int or type(col) is not int:
        raise TypeError
    return row, col


def _array(fields: Fields) -> CameraArray:
    sides = {name: fields.integer(name, 1, MAX_GRID_SIDE) for name in ("rows", "cols")}
    sides |= {name: fields.integer(name, 1, MAX_PICTURE_SIDE) for name in ("width", "height")}
    calibration = fields.inner("calibration")
    hint = fields.get("disparity_per_step_px", "[lo, hi] or null")
    return CameraArray(
        **sides,
        fps=_number(fields, "fps"),
        real_rows=fields.integers("real_rows"),
        real_cols=fields.integers("real_cols"),
        calibration=Calibration(
            **{name: _number(calibration, name) for name in _CALIBRATION},
            given=calibration.truth("given"),
        ),
        rho=_number(fields, "rho"),
        disparity_per_step_px=None if hint is None else fields.pair("disparity_per_step_px"),
        name=fields.text("name"),
    )


def _number(fields: Fields, key: str) -> float:
    """A finite number as it was written: a whole one stays whole when the header is written again."""
    fields.number(key)
    value: float = fields.values[key]
    return value


def map_cameras(array: CameraArray, which: str) -> tuple[Position, ...]:
    """The real cameras that send a map, in row order; `which` is one of DISPARITY_CAMERAS."""
    if which == "all":
        return array.real
    if which == "none":
        return ()
    return tuple(
        (row, col)
        for down, row in enumerate(array.real_rows)
        for across, col in enumerate(array.real_cols)
        if (down + across) % 2 == 0
    )


def view_name(position: Position) -> str:
    """``r00_c04``: the name of a view in topics, frame ids and output folders."""
    return f"r{position[0]:02d}_c{position[1]:02d}"
