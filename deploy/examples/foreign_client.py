# Your detector in another language: any Zenoh client that puts JSON. `pip install eclipse-zenoh`
import json, sys, time, zenoh

config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps(sys.argv[1:] or ["tcp/127.0.0.1:7447"]))
with zenoh.open(config) as session:
    show = lambda sample: print(json.loads(sample.payload.to_string())["objects"], flush=True)
    # Every hub; with the name of one in place of `*` that one alone is believed.
    fused = session.declare_subscriber("v2x/demo/hub/*/fused/json", show)
    camera = session.declare_publisher("v2x/demo/agent/camera/detections")
    epoch = time.time_ns()  # another one at each start: two that run under one name are noticed
    for tenth in range(50):
        car = {"class": "car", "x": 10 + tenth / 10, "y": 5.0}  # driving east at 1 m/s
        camera.put(json.dumps({"epoch": epoch, "captured_at": time.time_ns() // 1000, "detections": [car]}))
        time.sleep(0.1)
