# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The winch of test/payloads as an installed package of its own, which registers itself."""

from collections.abc import Mapping
import os
from pathlib import Path

from support.processes import ROOT

ENTRY_POINTS = """\
[illuminator_ros.payloads]
winch = my_winch.winch:WINCH
"""


def install_winch(site: Path, entry_points: str = ENTRY_POINTS) -> Mapping[str, str]:
    """Write the package into a folder, and return the environment of programs that have it."""
    package, metadata = site / 'my_winch', site / 'my_winch-1.0.dist-info'
    package.mkdir()
    metadata.mkdir()
    (package / '__init__.py').touch()
    for name in ('winch.py', 'winch_ros.py'):
        text = (ROOT / 'test' / 'payloads' / name).read_text()
        (package / name).write_text(text.replace('payloads.winch', 'my_winch.winch'))
    (metadata / 'METADATA').write_text('Metadata-Version: 2.1\nName: my_winch\nVersion: 1.0\n')
    (metadata / 'entry_points.txt').write_text(entry_points)
    return {'PYTHONPATH': os.pathsep.join(
        filter(None, (str(site), os.environ.get('PYTHONPATH'))))}
