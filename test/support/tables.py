# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The tables and diagrams of the documentation, and the parameter files."""

import re
from typing import Any

from support.processes import ROOT
import yaml


def table(document: str, first_heading: str) -> list[list[str]]:
    """Return the rows of the table whose first column has this heading."""
    rows = iter(document.splitlines())
    for line in rows:
        if line.startswith(f'| {first_heading} |'):
            next(rows)
            break
    else:
        raise AssertionError(f'no table {first_heading!r}')
    found = []
    for line in rows:
        if not line.startswith('|'):
            break
        found.append([cell.strip() for cell in line.strip('|').split('|')])
    return found


def diagnostic_values(page: str, status: str) -> set[str]:
    """Return the names of the values of a status that a page has."""
    rows = table((ROOT / 'doc' / f'{page}.md').read_text(), f'value of `{status}`')
    return {name for row in rows for name in re.findall('`([^`]+)`', row[0])}


def parameter_file(name: str) -> dict[str, Any]:
    """Return the parameters in a file of config/, by its name without the suffix."""
    content = yaml.safe_load((ROOT / 'config' / f'{name}.yaml').read_text())
    found: dict[str, Any] = content['/**']['ros__parameters']
    return found
