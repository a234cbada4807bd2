"""The settings of the fixtures are those of the engine, and no hub is left behind."""

import math
import tomllib

import numpy as np
import pytest

from v2x import testing


def test_every_dict_that_json_holds_is_toml():
    table = {
        "text": 'a "quoted" \\ line\n', "beyond 16 bits": "\U0001f697", "control": "\x7f\x01", "yes": True, "n": 2**40, "x": 1e-9,
        "list": [1, 2.5, "x"], "tables": [{"a": 1}, {"b": [{"c": 2}]}], "deep": {"er": {"k": []}, "with.dot": 1}, "none at all": {},
    }  # fmt: skip
    assert tomllib.loads(testing._toml(table)) == table
    numbers = tomllib.loads(testing._toml({"nan": math.nan, "inf": -math.inf}))
    assert math.isnan(numbers["nan"]) and numbers["inf"] == -math.inf


def test_what_toml_cannot_say_is_named():
    with pytest.raises(ValueError, match=r"agents.camera.sigma\[1\] is None"):
        testing._toml({"agents": {"camera": {"sigma": [1, None]}}})


def test_settings_are_those_that_the_engine_takes():
    expected = {"hub": {"method": "nms", "tiles": {"latitude_deg": 48.0}}}
    text = 'method = "nms"\n[tiles]\nlatitude_deg = 48.0\n'
    for config in (
        {"method": "nms", "tiles": {"latitude_deg": np.float64(48.0)}}, expected, {**expected, "name": "a scenario"},
        text, '[hub]\nmethod = "nms"\ntiles = { latitude_deg = 48.0 }\n',
    ):  # fmt: skip
        assert tomllib.loads(testing._settings(config)) == expected, config
    assert testing._settings("method = ") == "method = "


def test_all_hubs_end_though_one_does_not_end_cleanly():
    class Fake:
        def __init__(self, fails):
            self.fails, self.closed = fails, False

        def close(self):
            self.closed = True
            if self.fails:
                raise testing.HubError("it ended with code 1")

    hubs = [Fake(False), Fake(True), Fake(False)]
    with pytest.raises(testing.HubError):
        testing._close_all(hubs)
    assert all(hub.closed for hub in hubs)
    with pytest.raises(ExceptionGroup):
        testing._close_all([Fake(True), Fake(True)])
