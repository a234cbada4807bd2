"""What several tests need."""

import os
import pathlib
import shutil

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]


def pytest_configure(config):
    """Without $V2X_BINARY and without v2x on the path, the repository's own build is used."""
    built = ROOT / "target/debug/v2x"
    if "V2X_BINARY" not in os.environ and shutil.which("v2x") is None and built.exists():
        os.environ["V2X_BINARY"] = str(built)


@pytest.fixture
def patience():
    """How long a test waits for something that happens at once on an idle machine, s."""
    return 30.0
