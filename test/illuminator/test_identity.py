# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""COMPONENT_INFORMATION_BASIC, whose strings cannot be trusted to end."""

from illuminator_ros.illuminator.identity import Identity, text
from illuminator_ros.mavlink.messages import (
    ComponentInformationBasic,
    encode_payload,
    INFORMATION_ID,
)
import pytest
from support.messages import decode_payload


@pytest.mark.parametrize(('field', 'expected'), [
    (b'torch\0', 'torch'),
    (b'torch', 'torch'),
    (b'torch\0old rest', 'torch'),
    (b'', ''),
    (b'\0\0\0', ''),
    (b'  torch \0', 'torch'),
    (b'T\xc3\xbcr', 'T\u00fcr'),
    (b'T\xff', 'T\ufffd'),
    (b'T\xc3', 'T\ufffd'),
    (b'a\x1b[31mb', 'a?[31mb'),
    (b'a\nb', 'a?b'),
    (b'a\x7fb', 'a?b'),
    ('a\u202eb'.encode(), 'a?b'),
])
def test_a_char_field_is_its_printable_text(field, expected):
    assert text(field) == expected


def read(**fields: bytes) -> Identity:
    """Return an identity as it comes from the wire."""
    message = ComponentInformationBasic(
        0, 0, 0, *(fields.get(name, b'') for name in (
            'vendor_name', 'model_name', 'software_version', 'hardware_version',
            'serial_number')))
    return Identity.from_message(
        decode_payload(INFORMATION_ID, encode_payload(message).rstrip(b'\0')))


def test_each_string_is_read_from_its_field():
    assert read(vendor_name=b'v', model_name=b'm', software_version=b's', hardware_version=b'h',
                serial_number=b'n') == Identity('v', 'm', 's', 'h', 'n')


def test_strings_that_fill_their_fields_are_read_without_their_neighbours():
    identity = read(vendor_name=b'v' * 32, model_name=b'm' * 32, software_version=b's' * 24,
                    hardware_version=b'h' * 24, serial_number=b'n' * 32)
    assert identity == Identity('v' * 32, 'm' * 32, 's' * 24, 'h' * 24, 'n' * 32)


def test_what_the_light_leaves_out_is_empty():
    assert read() == Identity()
