"""``--target-psnr``, ``--bitrate`` with a layer: settings that are found by trials, told and recorded."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from mvcodec.capture import ArraySource
from mvcodec.cli.arguments import DEFAULT_SYNTHESIZER
from mvcodec.cli.progress import progress
from mvcodec.encoding.config import AUTO, EncoderConfig
from mvcodec.synthesis.synthesizers import make_synthesizer


def config_for_quality(
    source: ArraySource, chosen: range, config: EncoderConfig, arguments: argparse.Namespace
) -> tuple[EncoderConfig, dict[str, Any]]:
    """The settings that ``--target-psnr`` asks for: the largest QP, or base and layer with the fewest bits.

    Returns:
        The settings, and what ``--json`` says of the choice.

    Raises:
        SettingError: nothing reaches that quality.
        InputError: the input lacks a view's originals.
    """
    together = config.enhance == AUTO
    what = "look for base and layer" if together else "look for the QP"
    with progress(what, None, quiet=arguments.quiet, unit="coding") as bar:
        look = _together if together else _one_qp
        found, record = look(source, chosen, config, arguments.target_psnr, bar.update)
    if not arguments.quiet and not arguments.json:
        layer = f", layer {record['enhance']:g}" if isinstance(record["enhance"], int | float) else ""
        alone = ", no layer" if together and not layer else ""
        print(
            f"QP {record['qp']}{layer}{alone}: {record['psnr_y']:.2f} dB,"
            f" found by coding a few frame sets {record['codings']} times"
        )
    return found, record


def config_for_rate(
    source: ArraySource, chosen: range, config: EncoderConfig, arguments: argparse.Namespace
) -> tuple[EncoderConfig, dict[str, Any]]:
    """The settings with the layer, or without one, that goes best with ``--bitrate``, and the same record.

    Raises:
        SettingError, InputError: as `config_for_quality`.
    """
    from mvcodec.evaluation.joint_choice import choose_for_rate

    with progress("look for the layer", None, quiet=arguments.quiet, unit="coding") as bar:
        synthesizer = make_synthesizer(DEFAULT_SYNTHESIZER)
        found = choose_for_rate(source, chosen, config, synthesizer, bar.update)
    if not arguments.quiet and not arguments.json:
        layer = "no layer" if found.config.enhance is None else f"layer {found.config.enhance}"
        print(f"{layer}: about {found.psnr_y:.1f} dB, found by coding 2 frame sets {found.codings} times")
    return found.config, _record(source, found.config, found.psnr_y, found.codings)


def _one_qp(
    source: ArraySource, chosen: range, config: EncoderConfig, target_db: float, on_coding: Any
) -> tuple[EncoderConfig, dict[str, Any]]:
    from mvcodec.evaluation.target_quality import qp_for_quality

    found = qp_for_quality(
        source, chosen, config, target_db, make_synthesizer(DEFAULT_SYNTHESIZER), on_coding
    )
    config = replace(config, qp=found.qp)
    return config, _record(source, config, found.psnr_y, found.codings)


def _together(
    source: ArraySource, chosen: range, config: EncoderConfig, target_db: float, on_coding: Any
) -> tuple[EncoderConfig, dict[str, Any]]:
    from mvcodec.evaluation.joint_choice import choose_together

    synthesizer = make_synthesizer(DEFAULT_SYNTHESIZER)
    found = choose_together(source, chosen, config, target_db, synthesizer, on_coding)
    return found.config, _record(source, found.config, found.psnr_y, found.codings)


def _record(source: ArraySource, config: EncoderConfig, psnr_y: float, codings: int) -> dict[str, Any]:
    return {
        "qp": config.rate.qp,
        "enhance": config.enhance,
        "disparity_scale": config.scale_for(source.array),
        "second_reference": config.chosen_second_reference,
        "psnr_y": psnr_y,
        "codings": codings,
    }
