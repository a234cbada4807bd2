"""Script time and memory of the live view under load."""

import pathlib
import re
import subprocess
import time

from web_network import PATIENCE_S, ROOT


# Of script for each drawn frame, by the processor's clock: the page's own counter has what other programs take, too.
MOST_SCRIPT_MS = 8.0


def script_time(browser):
    """Processor seconds of all script so far, and the number of drawn frames."""
    metrics = {each["name"]: each["value"] for each in browser.call("Performance.getMetrics")["metrics"]}
    return metrics["ScriptDuration"], browser.run("window.v2x.stats.frames")


def measure_load(browser, v2x, folder, seconds):
    """Script time and memory with ten agents that each report some 200 objects ten times a second."""
    text = (ROOT / "deploy/scenarios/ten-agents.toml").read_text()
    for name, count in {"traffic": 1.0, "parked": 120, "works": 28, "pedestrians": 48, "bicycles": 8}.items():
        text = re.sub(rf"^{name} = .*$", f"{name} = {count}", text, flags=re.MULTILINE)
    text = re.sub(r"^(noise = .*)$", r"\1\nfield_of_view = { range_max_m = 200.0 }", text, flags=re.MULTILINE)
    (folder / "load.toml").write_text(text)
    log = open(folder / "up.log", "w")
    words = [v2x, "up", "load.toml", "--web", "0", "--listen", "tcp/127.0.0.1:0"]
    process = subprocess.Popen(words, stderr=log, cwd=folder)
    try:
        while not (found := re.search(r"http://\S+", (folder / "up.log").read_text())):
            assert process.poll() is None, (folder / "up.log").read_text()
            time.sleep(0.05)
        browser.size(1280, 800)
        browser.open(found[0])
        browser.wait("window.v2x.shown.length === 1 && window.v2x.state.agents.length === 10", "ten agents")
        # Processor time of the page's thread: other work on the machine counts in wall time only.
        browser.call("Performance.enable", timeDomain="threadTicks")
        end, before = time.monotonic() + seconds, script_time(browser)
        while time.monotonic() < end:
            browser.run("new Promise((done) => setTimeout(done, 15_000))")
            now = script_time(browser)
            per_frame_ms = 1000 * (now[0] - before[0]) / max(1, now[1] - before[1])
            before = now
            line = browser.run("""(() => {
                const s = window.v2x.stats, [shown] = window.v2x.shown;
                const detections = window.v2x.agentPlaces.reduce((sum, each) => sum + each.detections, 0);
                // Of an empty picture nothing is measured.
                if (!(shown?.objects > 100 && detections > 1000)) throw new Error(`${shown?.objects} objects, ${detections} detections`);
                return `${shown.objects} objects, ${detections} detections of 10 agents; script ${s.median.toFixed(1)} / ${s.p95.toFixed(1)} ms,`
                    + ` drawing ${s.drawMedian.toFixed(1)} / ${s.drawP95.toFixed(1)} ms (median / p95); ${s.frames} frames; kept ${(s.memoryBytes / 1e6).toFixed(0)} MB,`
                    + ` heap ${(performance.memory.usedJSHeapSize / 1e6).toFixed(0)} MB; ${s.skipped} skipped`;
            })()""")
            cpu = sum(map(int, pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
            print(f"{line}; script {per_frame_ms:.1f} CPU ms a drawn frame (mean); launcher and view {cpu / 100:.1f} CPU s", flush=True)
        assert per_frame_ms <= MOST_SCRIPT_MS, f"{per_frame_ms:.1f} CPU ms of script a drawn frame"
        assert not browser.complaints, browser.complaints
    finally:
        process.terminate()
        process.wait(timeout=PATIENCE_S)
        log.close()
