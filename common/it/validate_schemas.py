#!/usr/bin/env python3
"""Checks the shipped JSON schemas, and against them the golden JSON files and the JSON frames of the documents.

Needs the PyPI package `jsonschema`. Run from anywhere: python3 common/it/validate_schemas.py
A frame of a document is a fenced block of language `json` that holds `detections` or `fused_at`.
"""

import json
import re
import sys
from pathlib import Path

from jsonschema import Draft202012Validator

COMMON = Path(__file__).resolve().parent.parent
DOCUMENTS = COMMON.parent / "deploy/docs"
GOLDEN = {
    "detections.json": "detection-frame",
    "sensor.json": "sensor-description",
    "fused.json": "fused-frame",
    "delta.json": "delta-frame",
}


def validator(name):
    schema = json.loads((COMMON / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def frames_of(document):
    """Every JSON frame of a document with the name of its schema."""
    text = document.read_text(encoding="utf-8")
    for block in re.findall(r"^```json\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        value = json.loads(block)
        if isinstance(value, dict) and "key_sequence" in value:
            yield "delta-frame", value
        elif isinstance(value, dict) and "fused_at" in value:
            yield "fused-frame", value
        elif isinstance(value, dict) and "detections" in value:
            yield "detection-frame", value


def complaints(name, value):
    for error in validator(name).iter_errors(value):
        yield f"{'/'.join(map(str, error.absolute_path)) or '(top)'}: {error.message}"


def main():
    failures = []
    checked = 0

    def check(source, name, value):
        nonlocal checked
        checked += 1
        failures.extend(f"{source}: {complaint}" for complaint in complaints(name, value))
        if not list(complaints(name, {**value, "misspelt": 0})):
            failures.append(f"{source}: {name} accepts an unknown field")

    for folder in sorted((COMMON / "it" / "golden").iterdir()):
        for file, name in GOLDEN.items():
            path = folder / file
            check(path.relative_to(COMMON), name, json.loads(path.read_text(encoding="utf-8")))
    frames = [(page.name, *frame) for page in sorted(DOCUMENTS.glob("*.md")) for frame in frames_of(page)]
    if not any(name == "detection-frame" for _, name, _ in frames):
        failures.append(f"{DOCUMENTS}: no ```json block holds a detection frame")
    for page, name, value in frames:
        check(page, name, value)
    for failure in failures:
        print(failure, file=sys.stderr)
    print(f"{checked} frames checked, {len(failures)} complaints")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
