"""Your detector on a network, typed: an agent that publishes, and a consumer of what the hub makes of it.

python3 network.py [--once] [ENDPOINT]: needs `pip install './deploy/python[client]'` and a hub (`v2x hub`), for which it waits;
with --once it does not.
"""

import signal
import sys
import time

from v2x.client import DEFAULT_ENDPOINT, Agent, Consumer, NoHub
from v2x.messages import Detection, FieldOfView, Pose, SensorDescription, Sigma

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it
endpoint = next((one for one in sys.argv[1:] if one != "--once"), DEFAULT_ENDPOINT)
sensor = SensorDescription(FieldOfView(range_max_m=80.0), rate_hz=10.0, detection_probability=0.95)


def connected():
    says = True
    while True:
        try:
            return Consumer(connect=endpoint, patience_s=1.0)
        except NoHub as error:
            if "--once" in sys.argv:
                sys.exit(str(error))
            if says:
                print(f"{error}; waiting for it", file=sys.stderr, flush=True)
            says = False


with connected() as consumer, Agent("camera", connect=endpoint, description=sensor) as camera:
    frames = consumer.frames()
    # What is published before that, nobody gets.
    if not (camera.wait_until_heard() and frames.wait_until_fed()):
        sys.exit(f"what answers at {endpoint} is no hub of network demo: `v2x check` says which networks have one")
    for tenth in range(20):
        car = Detection("car", x=10 + tenth / 10, y=5.0, yaw=0.0, sigma=Sigma(x=0.3, y=0.3))  # driving east at 1 m/s
        sent = camera.publish([car], sensor_pose=Pose(0.0, 0.0))
        frame = frames.next(timeout=5)
        give_up = time.monotonic() + 2
        while sent.sequence not in [one.sequence for one in frame.includes] and time.monotonic() < give_up:
            frame = frames.next(timeout=5)
        if sent.sequence not in [one.sequence for one in frame.includes]:
            # It was refused or lost: the hub's lists go on without it.
            print(f"frame {sent.sequence} is in no list: `v2x check camera` says why", file=sys.stderr, flush=True)
            continue
        latency_ms = (frame.fused_at - sent.captured_at) / 1e6
        for one in frame.objects:
            print(f"{one.cls}: x {one.x:.2f} m, vx {one.vx:.2f} m/s, {latency_ms:.1f} ms after it was seen")
        time.sleep(0.1)
