"""The coders of all tracks of a stream, at one quality."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from mvcodec.array import Position
from mvcodec.encoding.config import EncoderConfig
from mvcodec.encoding.enhancer import Enhancer
from mvcodec.encoding.predicted_cameras import (
    CAMERA_LINE,
    LAYER_LINE,
    PredictedCameras,
    predicted_quantizer,
)
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track, TrackKind
from mvcodec.video.codec import CodedPicture, Planes, RateControl, VideoEncoder, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, grey_planes, to_planes
from mvcodec.video.disparity_code import quantise
from mvcodec.video.map_size import coded_size, to_coded
from mvcodec.workers import Job, settle, submit, submit_later, threads


class Coders:
    """Codes frame sets, from a keyframe on.

    Args:
        header: the stream's.
        config: with the quality of these coders; what its header leaves open is the header's.
        gop: frame sets from keyframe to keyframe.
        layer_views: views of the enhancement layer; none: no layer.
        coded_before: see `Encoder`.

    Raises:
        SettingError: a setting does not fit the array.
        LibvpxMissing: there is no libvpx, and something is predicted.
    """

    def __init__(
        self,
        header: StreamHeader,
        config: EncoderConfig,
        gop: int,
        layer_views: Sequence[Position] = (),
        coded_before: int = 0,
    ) -> None:
        self._header, self._config, self._gop, self._coded_before = header, config, gop, coded_before
        self._codec = find_codec(config.codec)
        array, scale = header.array, header.disparity_scale
        predicted = {each.camera for each in header.predicted}
        alone = tuple(camera for camera in array.real if camera not in predicted)
        pictures = even_size(array.width, array.height), config.rate_of_pictures(array)
        self._encoders = self._make(TrackKind.TEXTURE, alone, *pictures)
        if header.map_cameras:
            size = coded_size(array.width, array.height, scale)
            rate = config.rate_of_maps(array, header.disparity_range_px)
            self._encoders |= self._make(TrackKind.DISPARITY, header.map_cameras, size, rate)
        self._predicted: PredictedCameras | None = None
        if header.predicted:
            assert config.quality is not None
            quantizer = round(predicted_quantizer(config.quality, self._codec, CAMERA_LINE))
            self._predicted = PredictedCameras(header, self._codec, quantizer, config.chosen_preset)
        self._enhancer: Enhancer | None = None
        if layer_views:
            self._enhancer = enhancer(header, config, layer_views)

    def push(
        self,
        frames: FrameSet,
        keyframe: bool,
        match: Callable[[], Mapping[Position, DisparityMap]],
    ) -> list[Packet]:
        """Code one frame set.

        Args:
            match: gives the maps, of the pictures' size or as they are coded; pictures are coded meanwhile.

        Returns:
            The header's packet at a keyframe, then one for each track, pictures first.
        """
        jobs: dict[Track, Job[list[CodedPicture]]] = {}
        with threads(self._config.threads):
            try:
                self._submit(frames, keyframe, match, jobs)
            finally:
                settle(jobs.values())
            coded = {track: job.result()[0] for track, job in jobs.items()}
            if self._predicted is not None:
                wanted = (each.camera for each in self._header.predicted)
                pictures = {camera: to_planes(frames.pictures[camera]) for camera in wanted}
                coded |= self._predicted.push(coded, pictures, keyframe)
            packets = [_packet(track, frames, coded[track]) for track in self._header.tracks]
            if keyframe:
                head = Packet(HEADER_TRACK, frames.index, frames.time_ns, True, self._header.to_json())
                packets.insert(0, head)
            if self._enhancer is not None:
                packets = self._enhancer.push(packets, frames.pictures)
        return packets

    def flush(self) -> None:
        """End the stream."""
        for encoder in self._encoders.values():
            encoder.flush()

    def _submit(
        self,
        frames: FrameSet,
        keyframe: bool,
        match: Callable[[], Mapping[Position, DisparityMap]],
        jobs: dict[Track, Job[list[CodedPicture]]],
    ) -> None:
        for track in self._encoders:
            if track.kind is TrackKind.TEXTURE and track.camera is not None:
                picture = frames.pictures[track.camera]
                jobs[track] = submit_later(self._code_picture, track, picture, keyframe)
        maps = match()
        for camera in self._header.map_cameras:
            track = Track(TrackKind.DISPARITY, camera)
            jobs[track] = submit(self._code_map, track, maps[camera], keyframe)

    def _make(
        self, kind: TrackKind, cameras: tuple[Position, ...], size: tuple[int, int], rate: RateControl
    ) -> dict[Track, VideoEncoder]:
        pictures = kind is TrackKind.TEXTURE
        settings = VideoSettings(
            kind,
            *size,
            self._header.array.fps,
            self._gop,
            rate,
            self._config.chosen_preset,
            coded_before=self._coded_before,
            keyframe_ratio=self._config.keyframe_ratio if pictures else None,
        )
        return {Track(kind, camera): self._codec.encoder(settings) for camera in cameras}

    def _code_picture(self, track: Track, picture: Picture, keyframe: bool) -> list[CodedPicture]:
        return self._code(track, to_planes(picture), keyframe)

    def _code_map(self, track: Track, disparity: DisparityMap, keyframe: bool) -> list[CodedPicture]:
        header = self._header
        codes = quantise(disparity.values_px, header.disparity_range_px)
        median = self._config.median_for(header.array)
        is_whole = codes.shape == (header.array.height, header.array.width)
        scale = header.disparity_scale if is_whole else 1  # a matcher's map of half size
        return self._code(track, grey_planes(to_coded(codes, scale, median)), keyframe)

    def _code(self, track: Track, planes: Planes, keyframe: bool) -> list[CodedPicture]:
        return self._encoders[track].push(planes, keyframe)


def enhancer(header: StreamHeader, config: EncoderConfig, views: Sequence[Position]) -> Enhancer:
    """What codes the layer that settings ask for, beside a base of that header.

    Raises:
        LibvpxMissing: there is no libvpx.
    """
    quality = config.layer_quality(len(views), len(header.array.real))
    assert quality is not None
    assert config.enhance is not None
    quantizer = predicted_quantizer(quality, find_codec(config.codec), LAYER_LINE)
    return Enhancer(
        header,
        views,
        quantizer,
        config.chosen_preset,
        config.enhance,
        config.enhance_chain,
        config.chosen_second_reference,
    )


def _packet(track: Track, frames: FrameSet, picture: CodedPicture) -> Packet:
    return Packet(track, frames.index, frames.time_ns, picture.keyframe, picture.data)
