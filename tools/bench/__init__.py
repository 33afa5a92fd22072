# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Measures the figures of doc/performance.md; __main__.py is the program."""
