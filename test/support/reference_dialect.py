# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
pymavlink's generator as an oracle.

It generates classes from the definitions below, which pymavlink's wheels lack, for the parser and
encoder of pymavlink.
"""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
from functools import cache
import importlib.util
import io
from pathlib import Path
import tempfile
from typing import Any

from illuminator_ros.mavlink.dialect import raw
from illuminator_ros.mavlink.messages import Address
from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.generator import mavgen

# Message id, name and fields, in the order of common.xml; a bar before the extension fields.
Definitions = Mapping[int, tuple[str, str]]
DEFINITIONS: Definitions = {
    396: ('COMPONENT_INFORMATION_BASIC', 'uint32_t time_boot_ms units=ms, '
          'uint64_t capabilities enum=MAV_PROTOCOL_CAPABILITY display=bitmask, '
          'uint32_t time_manufacture_s units=s, char[32] vendor_name, char[32] model_name, '
          'char[24] software_version, char[24] hardware_version, char[32] serial_number'),
    440: ('ILLUMINATOR_STATUS', 'uint32_t uptime_ms units=ms, uint8_t enable, '
          'uint8_t mode_bitmask enum=ILLUMINATOR_MODE, '
          'uint32_t error_status enum=ILLUMINATOR_ERROR_FLAGS display=bitmask, '
          'uint8_t mode enum=ILLUMINATOR_MODE, float brightness units=%, '
          'float strobe_period units=s, float strobe_duty_cycle units=%, float temp_c, '
          'float min_strobe_period units=s, float max_strobe_period units=s, |, '
          'uint8_t zoom_level, uint8_t color_mode, '
          'uint8_t gimbal_device_id'),
}
LIGHT = Address(1, 243)


@cache
def reference() -> Any:
    """Return a copy of pymavlink's dialect that has the generated messages, too."""
    dialect = _load(Path(ardupilotmega.__file__))
    dialect.mavlink_map |= generated(DEFINITIONS)
    return dialect


def generated(messages: Definitions) -> dict[int, Any]:
    """Return the classes that pymavlink generates from definitions, by message id."""
    with tempfile.TemporaryDirectory() as directory:
        definitions, module = Path(directory, 'definitions.xml'), Path(directory, 'generated.py')
        definitions.write_text(_xml(messages))
        options = mavgen.Opts(
            str(module), wire_protocol='2.0', language='Python3', validate=False)
        with contextlib.redirect_stdout(io.StringIO()):
            assert mavgen.mavgen(options, [str(definitions)])
        return dict(_load(module).mavlink_map)


def _load(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def _xml(definitions: Definitions) -> str:
    def field(definition: str) -> str:
        if definition == '|':
            return '<extensions/>'
        type_, name, *attributes = definition.split()
        return f'<field type="{type_}" name="{name}" ' + ' '.join(
            '{}="{}"'.format(*one.split('=')) for one in attributes) + '>-</field>'

    messages = ''.join(
        f'<message id="{id_}" name="{name}"><description>-</description>'
        f'{"".join(map(field, fields.split(", ")))}</message>'
        for id_, (name, fields) in definitions.items())
    return (f'<mavlink><version>3</version><dialect>0</dialect>'
            f'<messages>{messages}</messages></mavlink>')


class Peer:
    """
    A component that runs on pymavlink alone.

    :param key: 32 bytes; it signs with this key and requires it; None for no signing.
    :param timestamp: of the next frame that it signs.
    """

    def __init__(
        self, source: Address = LIGHT, *, key: bytes | None = None, link_id: int = 0,
        timestamp: int = 0,
    ) -> None:
        self.mavlink = reference().MAVLink(None, source.system, source.component)
        self.mavlink.robust_parsing = True
        if key is not None:
            signing = self.mavlink.signing
            signing.secret_key, signing.sign_outgoing = key, True
            signing.link_id, signing.timestamp = link_id, timestamp

    def encode(self, message: Any, sequence: int = 0, *, version: int = 2) -> bytes:
        """Return the frame of a message of the :func:`reference` dialect."""
        self.mavlink.seq = sequence
        return bytes(message.pack(self.mavlink, force_mavlink1=version == 1))

    def decode(self, data: bytes) -> list[Any]:
        """Return the messages that it reads; a refused one is BAD_DATA."""
        return self.mavlink.parse_buffer(data) or []


def twin(message: Any) -> Any:
    """Return a message of this package as one of the :func:`reference` dialect."""
    return reference().mavlink_map[message.id](**fields_of(message))


def fields_of(message: Any) -> dict[str, Any]:
    """Return the fields of a message of this package or of the :func:`reference` dialect."""
    return {name: raw(message, name) for name in message.fieldnames}
