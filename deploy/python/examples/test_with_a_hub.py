"""A test of your own with a real hub: the fixture `hub` comes with the package. Run it with pytest."""

import time

from v2x.client import Agent, Consumer
from v2x.messages import Detection


def test_my_detectors_car_comes_back(hub):
    with Consumer(connect=hub.locator) as consumer, Agent("mine", connect=hub.locator) as mine:
        frames = consumer.frames(timeout=10)
        assert mine.wait_until_heard() and frames.wait_until_fed()
        begin = time.time_ns()
        mine.publish([Detection("car", 12.0, 5.0)], captured_at=begin)
        mine.publish([Detection("car", 12.0, 5.0)], captured_at=begin + 50_000_000)
        found = next(frame for frame in frames if frame.objects)
        assert [one.cls for one in found.objects] == ["vehicle.car"]
