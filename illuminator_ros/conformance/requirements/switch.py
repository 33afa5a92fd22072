"""MAV_CMD_ILLUMINATOR_ON_OFF."""

from __future__ import annotations

from ...mavlink.dialect import MavCmd
from ..bench import Bench
from ..requirement import Failed, ILLUMINATOR, MESSAGES, requirement


@requirement('on', 'is switched on', ILLUMINATOR, 'ON/OFF', changes=True)
async def on(bench: Bench) -> None:
    """Switch it on at low brightness."""
    await bench.baseline()
    one = await bench.switch(True)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')


@requirement('off', 'is switched off', ILLUMINATOR, 'ON/OFF', changes=True)
async def off(bench: Bench) -> None:
    """Switch it off."""
    one = await bench.switch(False)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')


@requirement('on-off-values', 'denies to be switched to anything but 0 and 1', MESSAGES,
             'MAV_CMD_ILLUMINATOR_ON_OFF', changes=True)
async def values(bench: Bench) -> None:
    """Try what is neither."""
    await bench.baseline()
    wrong = [await bench.refused(MavCmd.ILLUMINATOR_ON_OFF, (value,))
             for value in (-1.0, 2.0, 0.5, 255.0)]
    if any(wrong):
        raise Failed('; '.join(filter(None, wrong)))
