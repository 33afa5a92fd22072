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

"""Keys, as a terminal sends them."""

from illuminator_ros.cli.monitor.keys import HELP, KeyDecoder
import pytest


@pytest.mark.parametrize(('sent', 'keys'), [
    (b'q', ['q']), (b'+-', ['+', '-']), (b' ', ['space']), (b'\r', ['enter']),
    (b'\x1b[A', ['up']), (b'\x1bOB', ['down']), (b'\x1b[5~', ['page up']),
    (b'\x1b[A\x1b[Bx', ['up', 'down', 'x']), (b'\x03', ['ctrl-c']), ('é'.encode(), ['é']),
    (b'\x1b[1;5A', ['escape']), (b'\x1bx', ['escape', 'x']), (b'\xff', ['\ufffd']), (b'', []),
])
def test_what_is_sent_is_a_key(sent: bytes, keys: list[str]) -> None:
    assert KeyDecoder().feed(sent) == keys


@pytest.mark.parametrize('sent', [b'\x1b[A', b'\x1bOA', b'\x1b[5~', b'\x1b[1;5A'])
def test_a_sequence_may_come_in_any_pieces(sent: bytes) -> None:
    decoder = KeyDecoder()

    pieces = [decoder.feed(bytes([byte])) for byte in sent]

    assert pieces[:-1] == [[]] * (len(sent) - 1)
    assert pieces[-1] == KeyDecoder().feed(sent)
    assert not decoder.waiting


def test_an_escape_alone_is_a_key_when_nothing_follows() -> None:
    decoder = KeyDecoder()

    assert decoder.feed(b'\x1b') == []
    assert decoder.waiting
    assert decoder.feed(b'') == ['escape']
    assert not decoder.waiting


def test_no_key_has_two_meanings() -> None:
    spellings = [spelling for keys, _ in HELP for spelling in keys]

    assert len(spellings) == len(set(spellings))
