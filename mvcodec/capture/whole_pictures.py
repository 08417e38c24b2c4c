"""Which access units of a video from outside give whole pictures: decoders conceal what is missing."""

from __future__ import annotations

from mvcodec.video.access_unit import UnitFacts
from mvcodec.video.bits import NalError
from mvcodec.video.codecs import CODECS

NOT_STARTED = "a video before its first keyframe"
BUILDS_ON_LOSS = "it builds on a picture that is missing"


class WholePictures:
    """Follows one video's access units in coding order.

    Args:
        codec: a name of `CODECS`; of other codecs every picture counts as whole.
    """

    def __init__(self, codec: str) -> None:
        self._units = CODECS[codec].units() if codec in CODECS else None
        self._why = None if self._units is None else NOT_STARTED
        self._shown_from: int | None = None

    def push(self, data: bytes, time: int | None = None) -> tuple[str | None, UnitFacts | None]:
        """Why an access unit gives no whole picture (None where it does), and what it says of itself.

        Args:
            data: the access unit, NAL units in Annex B form.
            time: when its picture is shown, in any unit; None where nobody knows.
        """
        if self._units is None:
            return None, None
        try:
            unit = self._units.push(data)
        except NalError as error:
            self._why = f"damaged ({error})"
            return self._why, None
        if unit.keyframe:
            self._why = self._shown_from = None
        elif unit.recovers and self._why is not None:
            # Pictures that are shown before it may build on what is missing.
            self._why, self._shown_from = None, time
        elif unit.missing and self._why is None and unit.pictures:
            self._why = BUILDS_ON_LOSS
        early = time is not None and self._shown_from is not None and time < self._shown_from
        return BUILDS_ON_LOSS if early and self._why is None else self._why, unit

    def lose(self, why: str) -> None:
        """A picture turned out not to be whole; what builds on it isn't either, up to the next keyframe."""
        if self._units is not None:
            self._why = why
