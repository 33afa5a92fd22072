# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Conformance checks of any payload: a session with one device, requirements, a run, a report.

No I/O and no ROS: an executable runs the session over a link.

The names of ``__all__`` are public; all else is internal and may change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .component_requirements import with_common
    from .outcomes import Failed, Skipped
    from .requirements import PayloadChecks, requirement
    from .session import Session, Transaction
    from .specifications import MESSAGES, Specification
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'component_requirements': ['with_common'],
        'outcomes': ['Failed', 'Skipped'],
        'requirements': ['PayloadChecks', 'requirement'],
        'session': ['Session', 'Transaction'],
        'specifications': ['MESSAGES', 'Specification'],
    })

__all__ = [
    'Failed', 'MESSAGES', 'PayloadChecks', 'requirement', 'Session', 'Skipped', 'Specification',
    'Transaction', 'with_common']
