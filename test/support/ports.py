# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Ports and ROS domains that no other process on this machine takes during the test."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import itertools
import random
import socket

# Ports above those that Linux assigns to sockets by itself: no other socket gets one of them
# between the moments when a test claims it and when a program binds it. The ports of ROS domains
# are below.
FIRST, END = 61_000, 65_536
# Ports for one process of tests; a port is reused after so many others.
BLOCK = 64
# Domains up to 101 have ports below the ephemeral ones.
DOMAINS = range(1, 102)


def _claim(name: str) -> socket.socket:
    """Return a socket that claims a name; raise OSError if another process holds it."""
    claim = socket.socket(socket.AF_UNIX)
    try:
        # The name is in the kernel and not a file, so it ends with the process in any case.
        claim.bind(f'\0illuminator_ros_test_{name}')
    except OSError:
        claim.close()
        raise
    return claim


def _shuffled(numbers: range) -> list[int]:
    """Return numbers in random order, so that processes try different ones first."""
    return random.SystemRandom().sample(numbers, len(numbers))


class _Block:
    """The ports of this process."""

    def __init__(self) -> None:
        for first in _shuffled(range(FIRST, END - BLOCK, BLOCK)):
            with contextlib.suppress(OSError):
                self._claim = _claim(f'ports_{first}')
                self.ports = itertools.cycle(range(first, first + BLOCK))
                return
        raise RuntimeError('all ports for tests are claimed')


# Open it here and not on demand: tests count the open descriptors.
_BLOCK = _Block()


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM, host: str = '127.0.0.1') -> int:
    """Return a free port that no other test process gets."""
    host = host.strip('[]')
    family = socket.AF_INET6 if ':' in host else socket.AF_INET
    for port in itertools.islice(_BLOCK.ports, BLOCK):
        with contextlib.suppress(OSError), socket.socket(family, kind) as probe:
            probe.bind((host, port))
            return port
    raise RuntimeError('none of the ports for this process is free')


@contextlib.contextmanager
def claimed_domain() -> Iterator[int]:
    """Yield a ROS domain that no other process on this machine uses."""
    for domain in _shuffled(DOMAINS):
        try:
            claim = _claim(f'domain_{domain}')
        except OSError:
            continue
        with claim:
            if not _has_participants(domain):
                yield domain
                return
    raise RuntimeError('all ROS domains are in use')


def _has_participants(domain: int) -> bool:
    """Return whether a program listens on the ports of participants (DDSI-RTPS, 9.6.1.1)."""
    for participant in range(10):
        with socket.socket(type=socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7410 + 250 * domain + 2 * participant))
            except OSError:
                return True
    return False
