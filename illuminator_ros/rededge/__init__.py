# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A MicaSense multispectral camera: RedEdge, RedEdge-MX, RedEdge-P, Altum.

The camera takes position, UTC, attitude and mount angles in MAVLink 1 frames, writes them into the
metadata of its images, and captures on request.
https://micasense.github.io/rededge-api/api/serial.html
"""
