#!/usr/bin/env python3
"""Prints the counts of a stats file, one `key value` a line: no settings, no names, nothing that is a time or memory.

Zeros and nulls are left out, so that a key which counts nothing may come or go.
"""

import json
import sys

NOT_COUNTS = {"version", "threads", "settings", "stages", "notes", "file", "simd"}


def walk(key, value):
    if isinstance(value, dict):
        for name in sorted(value):
            if name not in NOT_COUNTS and not name.endswith(("_ms", "_bytes")):
                walk(f"{key}.{name}" if key else name, value[name])
    elif isinstance(value, list):
        for index, item in enumerate(value):
            walk(f"{key}[{index}]", item)
    elif isinstance(value, (int, float)) and value:
        print(key, repr(value))


with open(sys.argv[1], encoding="utf-8") as file:
    walk("", json.load(file))
