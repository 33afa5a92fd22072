# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The search for a device: ports, baud rates, and what is heard."""
