# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The gimbal payload: a client of gimbal managers, a manager, and simulated gimbals."""
