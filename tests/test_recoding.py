"""Files of ours as input of `encode`: another form, the same cameras, times and calibration."""

from __future__ import annotations

from pathlib import Path

import pytest
from coding import encoded_file, luma_psnr, make_array
from command_line import fails, succeeds

from mvcodec.container import read_info
from mvcodec.decoding.decoded_source import DecodedSource, is_own_file
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError

OPTIONS = ("--preset", "veryfast", "--matcher", "sgbm", "--quiet")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    path = tmp_path / "archive.mcap"
    path.write_bytes(encoded_file(make_array(), 3, 5, prediction="synthesis", qp=20))
    return path


def test_the_source_gives_the_decoded_pictures_with_their_numbers_and_times(archive: Path) -> None:
    source = DecodedSource(archive)
    assert (source.frame_count, source.first_frame, source.array) == (3, 5, make_array())
    with Decoder.open(archive) as decoder:
        expected = list(decoder)
    for taken, decoded in zip(source.frame_sets(slice(1, 3)), expected[1:], strict=True):
        assert (taken.index, taken.time_ns) == (decoded.index, decoded.time_ns)
        for camera in source.array.real:
            assert (taken.pictures[camera] == decoded.pictures[camera]).all()
    with pytest.raises(InputError, match="no picture of view r05_c00"):
        list(source.frame_sets(views=[(5, 0)]))


def test_an_archive_becomes_a_plain_file_that_every_viewer_plays(archive: Path, tmp_path: Path) -> None:
    plain = tmp_path / "plain.mcap"
    succeeds("encode", archive, plain, "--qp", "20", "--disparity-cameras", "all", *OPTIONS)
    old, new = read_info(archive).header, read_info(plain).header
    assert (old.version, new.version) == (2, 1)
    assert (new.array, new.disparity_range_px, new.first_frame) == (
        old.array,
        old.disparity_range_px,
        old.first_frame,
    )
    with Decoder.open(archive) as one, Decoder.open(plain) as other:
        for before, after in zip(one, other, strict=True):
            assert (before.index, before.time_ns) == (after.index, after.time_ns)
            for camera in old.array.real:
                assert luma_psnr(before.pictures[camera], after.pictures[camera]) > 35


def test_what_such_a_file_has_of_its_own_is_no_option(archive: Path, tmp_path: Path) -> None:
    line = fails(2, "encode", archive, tmp_path / "x.mcap", "--real", "all", *OPTIONS)
    assert "--real: found all, expected no such option" in line
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(b"no MCAP")
    assert is_own_file(archive)
    assert not is_own_file(damaged)
    assert "--topics: found nothing" in fails(2, "encode", damaged, tmp_path / "x.mcap", *OPTIONS)
