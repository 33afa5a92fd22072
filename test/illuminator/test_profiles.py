# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge serves each profile of the simulated light, which imitates a real light."""

from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties, PROFILES
from illuminator_ros.mavlink.dialect import encode, mavlink
from illuminator_ros.mavlink.messages import CommandInt
from illuminator_ros.payload.attempt import FENCE
import pytest
from support.back_to_back import Pair
from support.light_bench import LightBench

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE


def described(profile: str, **settings: Any) -> IlluminatorProperties:
    return replace(PROFILES[profile].properties, **settings)


@pytest.mark.parametrize(('profile', 'settings'), [
    *((profile, {}) for profile in PROFILES),
    # The bridge does not refuse a mode because of a bitmask of either convention.
    *(('default', {'mode_bitmask': bits}) for bits in (1, 3, 6)),
    ('default', {'status_interval': 0.0})])
def test_each_kind_of_light_is_found_switched_configured_restored_and_never_lost(
    profile: str, settings: dict[str, Any],
) -> None:
    pair = Pair([described(profile, **settings)]).settle()
    strobes = profile != 'ardusub'
    assert pair.light.address == PROFILES[profile].properties.address
    for on in (True, False, True):
        assert pair.enable(on).success
        assert pair.light.twin.status is not None and pair.light.twin.status.enabled is on
    assert pair.configure(brightness=30).success
    assert pair.configure(strobe_period=1).success is strobes
    # A set that follows a refused one within 1.5 s cannot be confirmed in its time.
    pair.run(FENCE)
    assert pair.configure(mode='external_sync').success is strobes
    pair.run(FENCE)
    assert pair.configure(mode='internal_control').success
    pair.run(60.0)
    assert pair.recorder.events == ['connected']
    assert pair.light.twin.strobe_range.known is strobes
    assert (pair.snapshot.temperature is not None) is strobes
    identity = pair.snapshot.identity
    assert (identity is not None) is strobes
    if profile == 'reference':
        # 28 characters in a field of 24, so it has no terminator.
        assert identity is not None
        assert identity.software_version == 'Illuminator Software Ver'
        assert not any(isinstance(message, CommandInt) for message in pair.commands())
    pair.close()
    pair.device.restart(pair.now)
    pair.run(10.0)
    pair.open()
    pair.run(10.0)
    if not strobes:
        # A brightness would switch it on.
        assert not pair.lamp.enabled
        assert pair.enable(True).success
        pair.run(2.0)
    assert pair.lamp.configuration.brightness == 30.0


def test_the_reference_heats_like_full_power_at_a_brightness_of_nan() -> None:
    bench = LightBench(properties=described('reference'))
    bench.command(CONFIGURE, 1, float('nan'), 0, 0)
    bench.command(ON_OFF, 1)
    bench.run(10.0)
    assert bench.status().temp_c > 25.0


def test_a_light_of_ardusub_is_off_at_brightness_0_and_on_restores_the_last_one() -> None:
    bench = LightBench(properties=described('ardusub'))
    for command, state in (((CONFIGURE, 1, 40, 0, 0), (1, 40)), ((ON_OFF, 0), (0, 0)),
                           ((ON_OFF, 1), (1, 40)), ((CONFIGURE, 1, 0, 0, 0), (0, 0)),
                           ((ON_OFF, 1), (1, 40))):
        bench.command(*command)
        assert (bench.status().enable, bench.status().brightness) == state
    assert bench.status().mode_bitmask == 2


@pytest.mark.parametrize('profile', ['extended', 'default'])
def test_three_bytes_follow_the_common_35_with_the_same_crc_extra(profile: str) -> None:
    status = LightBench(properties=described(
        profile, zoom_level=7, color_mode=2, gimbal_device_id=154)).status()
    payload = encode(status)
    assert (len(payload), payload[35:], status.crc_extra) == (38, bytes([7, 2, 154]), 66)
