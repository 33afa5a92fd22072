# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pictures of the documentation, drawn again, and their places in it."""

from pathlib import Path
import re
import sys
from xml.etree import ElementTree

import pytest
from support.processes import Program, ROOT

# Texts of each picture, as the devices must answer the keys.
TEXTS = {
    'monitor-light': ['/illuminator ON OK brightness 80 %: done', '2 lights: 1 ON, 1 off'],
    'monitor-gimbal': ['/gimbal ours OK', 'yaw to 20.0 left in', 'pitch 30.0 down'],
    'monitor-camera': ['capture: done : image 1 taken', '/rededge ok WARN'],
    'monitor-phone': ['/illuminator ON', 'space on/off', 'a ALL OFF']}


def text_of(picture: str) -> str:
    """Return the text of a picture, with single spaces."""
    elements = ElementTree.fromstring(picture).iter('{http://www.w3.org/2000/svg}text')
    return ' '.join(' '.join(element.text or '' for element in elements).split())


def test_pictures_are_drawn_from_real_devices_and_load_nothing(
    domain: int, tmp_path: Path,
) -> None:
    for needed in ('textual', 'serial'):
        pytest.importorskip(needed)
    program = Program(sys.executable, '-m', 'tools.pictures', '--output', str(tmp_path),
                      env={'ROS_DOMAIN_ID': str(domain)})
    try:
        assert program.wait(110.0) == 0, program.log
    finally:
        program.kill()

    pictures = {path.stem: path.read_text() for path in tmp_path.iterdir()}
    assert pictures.keys() == TEXTS.keys()
    for name, texts in TEXTS.items():
        assert [text for text in texts if text not in text_of(pictures[name])] == []
        assert 'url(http' not in pictures[name]


def test_each_picture_is_in_a_page_and_each_page_has_its_pictures() -> None:
    shown = {name for page in (ROOT / 'README.md', *(ROOT / 'doc').glob('*.md'))
             for name in re.findall(r'!\[[^]]+\]\((?:doc/)?pictures/([^)]+)\.svg\)',
                                    page.read_text())}

    assert shown == {path.stem for path in (ROOT / 'doc' / 'pictures').iterdir()} == {*TEXTS}
