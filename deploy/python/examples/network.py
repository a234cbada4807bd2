"""Your detector on a network, typed: an agent that publishes, and a consumer of what the hub makes of it.

python3 network.py [ENDPOINT]: needs a hub (`v2x hub`) and `pip install 'v2x[client]'`.
"""

import sys
import time

from v2x.client import DEFAULT_ENDPOINT, Agent, Consumer
from v2x.messages import Detection, FieldOfView, Pose, SensorDescription, Sigma

endpoint = sys.argv[1] if len(sys.argv) > 1 else DEFAULT_ENDPOINT
sensor = SensorDescription(FieldOfView(range_max_m=80.0), rate_hz=10.0, detection_probability=0.95)

with Consumer(connect=endpoint) as consumer, Agent("camera", connect=endpoint, description=sensor) as camera:
    frames = consumer.frames()
    camera.wait_until_heard()  # what is published before that, nobody gets
    frames.wait_until_fed()
    for tenth in range(20):
        car = Detection("car", x=10 + tenth / 10, y=5.0, yaw=0.0, sigma=Sigma(x=0.3, y=0.3))  # driving east at 1 m/s
        sent = camera.publish([car], sensor_pose=Pose(0.0, 0.0))
        frame = frames.next(timeout=5)
        while sent.sequence not in [one.sequence for one in frame.includes]:
            frame = frames.next(timeout=5)
        latency_ms = (frame.fused_at - sent.captured_at) / 1e6
        for one in frame.objects:
            print(f"{one.cls}: x {one.x:.2f} m, vx {one.vx:.2f} m/s, {latency_ms:.1f} ms after it was seen")
        time.sleep(0.1)
