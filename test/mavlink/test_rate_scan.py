# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The order of baud rates, and protocols that are not MAVLink."""

from __future__ import annotations

from illuminator_ros.mavlink.search.rate_scan import ENOUGH, other_protocol, RateScan, SHARE
import pytest

NMEA = b'$GPGLL,4916.45,N,12311.12,W,225444,A*31\r\n'
UBX = bytes.fromhex('b5620501020006010f38')
BOOT = b'Starting kernel ...\r\n[ 0.0] Booting Linux on physical CPU 0x0\r\nlogin: '


@pytest.mark.parametrize(('data', 'named'), [
    (NMEA, 'NMEA'), (b'\x12\xff' + UBX, 'UBX'),
    (b'\xfdgarbage\r\n' + BOOT, "'Starting kernel ...'"), (BOOT, "'[ 0.0] Booting"),
    (NMEA.replace(b'*31', b'*32'), ''), (UBX[:-1] + b'\0', ''),
    (bytes(range(256)), ''), (b'a few words\r\n', ''), (b'x' * 200, '')])
def test_what_is_not_mavlink_is_named_only_where_it_is_certain(data: bytes, named: str) -> None:
    found = other_protocol(data)
    assert named in found if named else found == ''


def test_each_rate_has_its_time_again_and_again_and_many_bytes_end_it_sooner() -> None:
    scan = RateScan((1, 2, 3), SHARE, 0.0)

    assert scan.next_rate(SHARE - 0.1) is None
    assert scan.next_rate(SHARE) == 2
    scan.feed(bytes(ENOUGH - 1))
    assert scan.next_rate(SHARE + 0.1) is None
    scan.feed(b'\0')
    assert [scan.next_rate(SHARE + 0.1), scan.next_rate(2 * SHARE + 0.1)] == [3, 1]


def test_a_port_of_another_protocol_keeps_its_rate() -> None:
    scan = RateScan((1, 2), SHARE, 0.0)
    scan.feed(NMEA)

    assert scan.next_rate(100.0) is None
