# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Entries in the containers of an object, which show whether its memory is bounded."""

from collections import deque
import gc
from types import FunctionType, ModuleType


def stores(root: object, *others: object) -> dict[str, int]:
    """
    Return the sizes of all containers that an object holds, by the class and attribute with them.

    The largest counts of several with one name, such as the stores of each device.

    :param others: objects that are left out, with everything that only they hold.
    """
    seen, found = {id(one) for one in others}, dict[str, int]()
    todo: list[tuple[str, object]] = [('root', root)]
    while todo:
        name, one = todo.pop()
        if id(one) in seen or isinstance(one, type | ModuleType | FunctionType):
            continue
        seen.add(id(one))
        if isinstance(one, dict | list | set | deque):
            found[name] = max(found.get(name, 0), len(one))
            inner = list(one.values()) if isinstance(one, dict) else list(one)
            todo += [(f'{name}[]', value) for value in inner]
        elif fields := _fields(one):
            todo += [(f'{type(one).__name__}.{field.strip("_")}', value)
                     for field, value in fields.items()]
        else:
            todo += [(name, value) for value in gc.get_referents(one)]
    return found


def _fields(one: object) -> dict[str, object]:
    slots = [slot for cls in type(one).__mro__ for slot in getattr(cls, '__slots__', ())]
    return {**getattr(one, '__dict__', {}),
            **{slot: getattr(one, slot) for slot in slots if hasattr(one, slot)}}
