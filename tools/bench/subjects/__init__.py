# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Each subject is a generator function of its name that yields its rows."""

# Their modules, in the order in which they are run.
SUBJECTS = {
    'enable': 'services', 'status': 'topics', 'gimbal': 'topics',
    'gimbal_manager': 'gimbal_manager', 'foreign': 'receiving', 'burst': 'receiving',
    'noise': 'receiving', 'memory': 'process', 'startup': 'services', 'overhead': 'link',
    'forward': 'forwarding',
    'lights': 'link', 'nodes': 'process', 'reconnection': 'link', 'loss': 'link',
    'floods': 'floods', 'rededge': 'rededge', 'limits': 'services'}
