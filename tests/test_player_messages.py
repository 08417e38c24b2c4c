"""Whatever a page says, it is one of the messages or an InputError of one short line."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mvcodec.array import Viewpoint
from mvcodec.errors import InputError
from mvcodec.player.messages import (
    MAX_MESSAGE_BYTES,
    Dolly,
    Eyes,
    Focus,
    Loop,
    Message,
    Move,
    Play,
    Probe,
    Ready,
    Seek,
    Show,
    Shown,
    Speed,
    Wipe,
    parse_message,
)

LEGAL: list[tuple[str, Message]] = [
    ('{"type": "ready"}', Ready()),
    ('{"type": "move", "row": 0.5, "col": 2}', Move(Viewpoint(0.5, 2.0))),
    ('{"type": "seek", "frame": 12}', Seek(12)),
    ('{"type": "play", "playing": true}', Play(True)),
    ('{"type": "speed", "factor": 0.25}', Speed(0.25)),
    ('{"type": "loop", "loop": false}', Loop(False)),
    ('{"type": "show", "look": "layers"}', Show("layers")),
    ('{"type": "eyes", "mode": "anaglyph", "steps": 0.5}', Eyes("anaglyph", 0.5)),
    ('{"type": "focus", "px": 7.5}', Focus(7.5)),
    ('{"type": "focus", "px": null}', Focus(None)),
    ('{"type": "dolly", "share": 0.2}', Dolly(0.2)),
    ('{"type": "wipe", "share": 1}', Wipe(1.0)),
    ('{"type": "probe", "x": 0, "y": 1}', Probe(0.0, 1.0)),
    ('{"type": "shown", "picture": 3}', Shown(3)),
]

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
kinds = st.sampled_from([json.loads(text)["type"] for text, _ in LEGAL])
names = st.sampled_from(
    ["row", "col", "frame", "playing", "factor", "look", "mode", "px", "steps", "picture"]
)


@pytest.mark.parametrize(("text", "message"), LEGAL)
def test_legal_messages_are_read(text: str, message: Message) -> None:
    assert parse_message(text) == message


def refused_or_a_message(text: str | bytes) -> None:
    reason = ""
    try:
        parse_message(text)
    except InputError as error:
        reason = str(error)
    assert len(reason) < 300
    assert "\n" not in reason


@given(st.text() | st.binary())
def test_any_text_or_bytes_are_a_message_or_refused(text: str | bytes) -> None:
    refused_or_a_message(text)


@given(json_values)
def test_any_json_is_a_message_or_refused(value: object) -> None:
    refused_or_a_message(json.dumps(value))


@given(kinds, st.dictionaries(names, json_values, max_size=3))
def test_any_fields_are_a_message_or_refused(kind: str, fields: dict[str, object]) -> None:
    refused_or_a_message(json.dumps({"type": kind, **fields}))


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_places_come_through_unchanged(row: float, col: float) -> None:
    text = json.dumps({"type": "move", "row": row, "col": col})
    assert parse_message(text) == Move(Viewpoint(row, col))


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "move", "row": 0}',
        '{"type": "move", "row": 0, "col": 0, "more": 1}',
        '{"type": "move", "row": NaN, "col": 0}',
        '{"type": "move", "row": 1e999, "col": 0}',
        '{"type": "move", "row": true, "col": 0}',
        '{"type": "seek", "frame": 0.5}',
        '{"type": "seek", "frame": ' + "9" * 400 + "}",
        '{"type": "play", "playing": 1}',
        '{"type": "speed", "factor": 0}',
        '{"type": "show", "look": "nothing"}',
        '{"type": "eyes", "mode": "three", "steps": 1}',
        '{"type": "focus", "px": "near"}',
        '{"type": "quit"}',
        '{"type": ["move"]}',
        "[" * 900,
        '{"type": "ready"' + " " * MAX_MESSAGE_BYTES + "}",
    ],
)
def test_malformed_messages_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        parse_message(text)
