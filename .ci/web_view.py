"""The live view in a headless Chromium, over a real network.

Usage: web_view.py V2X [--screenshots FOLDER] [--readme FILE] [--load SECONDS]

V2X is the built program, such as target/debug/v2x. Starts a hub, two agents and the view as processes, opens the page, and
checks what it shows against what the hub published. With --screenshots it writes the page at three widths in light and dark;
with --readme only the picture of the README is made; with --load only script time and memory under load are measured.
"""

import argparse
import json
import pathlib
import queue
import re
import socket
import subprocess
import tempfile
import threading
import time
import urllib.error
import urllib.request

from chromium import Browser

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENARIO = ROOT / "deploy/scenarios/crossing.toml"
PATIENCE_S = 60
WIDTHS = [(400, 860), (1024, 768), (1920, 1080)]
# The README's picture: as wide as GitHub shows it, with twice the pixels.
README_SIZE = (1280, 840)
README_QUALITY = 82

# A car in motion that both agents see, in the picture and not an agent itself.
IS_TELLING = """(() => {
    const {selection, contributors} = window.v2x.state;
    const text = document.getElementById('selected-body').innerText;
    const k = window.v2x.shown[0].tracks.indexOf(selection?.track);
    if (k < 0 || contributors.length < 2 || !text.includes('vehicle.car')) return false;
    const {x, y} = window.v2x.placeOf(k);
    const canvas = document.getElementById('canvas');
    const isInside = x > 120 && y > 90 && x < canvas.clientWidth - 120 && y < canvas.clientHeight - 90;
    const isApart = window.v2x.agentPlaces.every((place) => Math.hypot(place.x - x, place.y - y) > 60);
    return isInside && isApart && Number(/speed m\\/s\\s+([\\d.]+)/.exec(text)?.[1]) > 2;
})()"""

# Until what was just changed has been drawn.
NEXT_DRAWING = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Network:
    """A hub, two agents and a view, each a process that can be ended alone."""

    def __init__(self, v2x, folder):
        self.v2x, self.folder = v2x, folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.processes = {}
        self.url = self.start_view()

    def start(self, name, *words, **options):
        log = open(self.folder / f"{name}.log", "a")
        self.processes[name] = subprocess.Popen([self.v2x, *words], stderr=log, cwd=self.folder, **options)
        log.close()
        return self.processes[name]

    def start_view(self):
        self.start("view", "watch", "--web", "0", "--connect", self.endpoint, "--scenario", str(SCENARIO))
        return self.logged("view", r"http://\S+")

    def logged(self, name, pattern):
        """Waits for a text in a process's log."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if found := re.search(pattern, (self.folder / f"{name}.log").read_text()):
                return found[0]
            assert self.processes[name].poll() is None, f"{name} ended: {(self.folder / f'{name}.log').read_text()}"
            time.sleep(0.02)
        raise AssertionError(f"{name} did not print {pattern}")

    def start_hub(self, name="hub", *more):
        self.start(name, "hub", "--listen", self.endpoint, "--config", str(SCENARIO), *more)

    def start_agents(self):
        for agent in ("ego", "rsu"):
            self.start_agent(agent)

    def start_agent(self, agent):
        self.start(agent, "agent", "--scenario", str(SCENARIO), "--id", agent, "--connect", self.endpoint)

    def end(self, name, has_to_succeed=True):
        process = self.processes.pop(name)
        process.terminate()
        code = process.wait(timeout=PATIENCE_S)
        assert code == 0 or not has_to_succeed, f"{name}: exit code {code}\n{(self.folder / f'{name}.log').read_text()}"

    def kill(self, name):
        process = self.processes.pop(name)
        process.kill()
        process.wait()

    def end_all(self):
        for name in list(self.processes):
            self.end(name, has_to_succeed=False)


class Published:
    """The fused frames as another consumer gets them."""

    def __init__(self, network):
        words = ["watch", "--json", "--connect", network.endpoint]
        self.process = network.start(f"watch-{free_port()}", *words, stdout=subprocess.PIPE, text=True)
        self.frames, self.arrived = {}, queue.Queue()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.arrived.put(json.loads(line))

    def frame(self, lineage, sequence):
        """The frame of a number; None where it came before the first one here."""
        newest = (0, 0)
        while (lineage, sequence) not in self.frames and newest <= (lineage, sequence):
            frame = self.arrived.get(timeout=PATIENCE_S)
            newest = int(frame["lineage"]), int(frame["sequence"])
            self.frames[newest] = frame
        return self.frames.get((lineage, sequence))


def check_guard(url):
    """A name that resolves to this machine is not enough."""
    request = urllib.request.Request(url + "events", headers={"Host": "evil.example"})
    try:
        urllib.request.urlopen(request, timeout=10)
        raise AssertionError("another host name was answered")
    except urllib.error.HTTPError as refused:
        assert refused.code == 403, refused.code


def check_empty_state(browser, url):
    browser.open(url)
    words = browser.wait("!document.getElementById('empty').hidden && document.getElementById('empty').innerText.includes('hub')"
                         " && document.getElementById('empty').innerText", "an empty state before there is a hub")
    assert "v2x up crossing" in words, words


def check_picture(browser):
    """The canvas has more colours than its ground, and those of what is drawn."""
    browser.wait("window.v2x.shown.length === 1 && window.v2x.shown[0].objects > 5", "objects")
    browser.wait("window.v2x.state.agents.length === 2", "both agents")
    count = """(() => {
        const canvas = document.getElementById('canvas');
        const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const colours = new Map();
        for (let k = 0; k < data.length; k += 4) {
            const colour = (data[k] << 16) | (data[k + 1] << 8) | data[k + 2];
            colours.set(colour, (colours.get(colour) ?? 0) + 1);
        }
        const style = getComputedStyle(document.documentElement);
        const of = (colour) => colours.get(parseInt(colour.trim().slice(1), 16)) ?? 0;
        const named = (name) => of(style.getPropertyValue(name));
        return {all: colours.size, ours: named('--ours'), truth: named('--truth'), ego: of('#D55E00'), rsu: of('#009E73')};
    })()"""
    # Without labels, which have the colour of the boxes.
    browser.key("8", "8")
    browser.run(NEXT_DRAWING)
    colours = browser.run(count)
    assert all(count > 20 for count in colours.values()), colours
    # The key of a layer takes its boxes away, and brings them back.
    browser.key("1", "1")
    browser.run(NEXT_DRAWING)
    hidden = browser.run(count)
    assert hidden["ours"] < colours["ours"] / 10, (colours, hidden)
    browser.key("1", "1")
    browser.key("8", "8")


def check_counts(browser, published):
    """Objects and their tracks are those of the published frame of the same number, in several frames."""
    seen, end = set(), time.monotonic() + PATIENCE_S
    while len(seen) < 5:
        assert time.monotonic() < end, f"{len(seen)} frames of the page were published"
        shown = browser.run("window.v2x.shown[0]")
        frame = published.frame(int(shown["lineage"]), int(shown["sequence"]))
        if frame is None:
            continue
        assert shown["objects"] == len(frame["objects"]), (shown, len(frame["objects"]))
        as_text = [f"{int(each['track']) >> 32:08x}-{int(each['track']) & 0xffffffff}" for each in frame["objects"]]
        assert shown["tracks"] == as_text, (shown["tracks"], as_text)
        seen.add(shown["sequence"])


def check_selection(browser):
    """A click selects what is there, and its contributors are drawn and listed."""
    browser.wait("window.v2x.stats.frames > 30", "drawn frames")
    browser.key(" ", " ")
    browser.wait("window.v2x.state.paused", "pause by the space bar")
    n_objects = browser.run("window.v2x.shown[0].objects")
    for k in range(n_objects):
        place = browser.run(f"(() => {{ const p = window.v2x.placeOf({k}), box = document.getElementById('canvas').getBoundingClientRect();"
                            " return {x: p.x + box.left, y: p.y + box.top, in: p.x > 20 && p.y > 20 && p.x < box.width - 60 && p.y < box.height - 20}; })()")
        if not place["in"]:
            continue
        browser.click(place["x"], place["y"])
        browser.wait("window.v2x.state.selection", "a selection after a click")
        state = browser.run("window.v2x.state")
        if len(state["contributors"]) >= 2 and all(each["isDrawn"] for each in state["contributors"]):
            break
    else:
        raise AssertionError("no object with two contributors could be selected")
    rows = browser.wait("document.getElementById('contributors')?.rows.length", "the list of contributors")
    assert rows == 1 + len(state["contributors"]), (rows, state)
    assert browser.run("document.getElementById('selected-body').innerText").count("±") >= 4


def check_time(browser):
    """While paused nothing moves by itself; steps and slider do."""
    before = browser.run("window.v2x.shown[0].sequence")
    browser.wait("window.v2x.stats.held > 10", "frames that are skipped while paused")
    assert browser.run("window.v2x.shown[0].sequence") == before, "a paused picture moved"
    browser.key("ArrowLeft")
    browser.wait(f"window.v2x.shown[0].sequence < {before}", "a step back")
    browser.key("ArrowRight")
    browser.wait(f"window.v2x.shown[0].sequence === {before}", "a step on")
    browser.run("(() => { const s = document.getElementById('slider'); s.value = '-50'; s.dispatchEvent(new Event('input')); })()")
    browser.wait(f"window.v2x.shown[0].sequence < {before} - 5", "the oldest list by the slider")
    browser.run("document.getElementById('pause').click()")
    browser.wait(f"!window.v2x.state.paused && window.v2x.shown[0].sequence > {before}", "live again")


def check_restart(browser, network):
    """A killed hub is missed, and its successor is shown without a reload."""
    lineage = browser.run("window.v2x.shown[0].lineage")
    network.kill("hub")
    browser.wait("document.getElementById('verdict').dataset.level === 'bad'", "a verdict that the hub is gone")
    network.start_hub()
    browser.wait(f"window.v2x.shown[0].lineage !== {lineage} && window.v2x.shown[0].objects > 5", "the next hub")
    browser.wait("document.getElementById('verdict').dataset.level === 'good'", "a good verdict after the restart")
    return Published(network)


def check_refusals(browser, network):
    """Frames that are too late flash at their agent with the reason, and the verdict names it."""
    slow = re.sub(r"delay_ms = \d+", "delay_ms = 4000", SCENARIO.read_text())
    (network.folder / "slow.toml").write_text(slow)
    network.end("rsu")
    network.start("rsu", "agent", "--scenario", "slow.toml", "--id", "rsu", "--connect", network.endpoint)
    browser.wait("window.v2x.state.events.some((each) => each.agent === 'rsu' && each.level === 'refused' && each.text.includes('late'))", "a refusal with its reason")
    browser.wait("document.getElementById('verdict').innerText.includes('Frames refused') && document.getElementById('verdict').innerText.includes('rsu')", "a verdict of refused frames")
    network.end("rsu")
    network.start_agent("rsu")
    browser.wait("document.getElementById('verdict').dataset.level === 'good'", "a good verdict after the refusals")


def check_widths(browser, folder):
    for width, height in WIDTHS:
        browser.size(width, height)
        for scheme in ("light", "dark"):
            browser.media(prefers_color_scheme=scheme)
            browser.wait(f"document.getElementById('canvas').clientWidth > 0 && innerWidth === {width}", "the size")
            browser.run("new Promise((done) => setTimeout(done, 700))")
            overflow = browser.run("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            assert overflow <= 0, f"{overflow} pixels too wide at {width}"
            assert browser.run("document.getElementById('canvas').clientHeight") > 200
            if folder:
                browser.picture(folder / f"view-{width}-{scheme}.png", captureBeyondViewport=width < 800)
    browser.media(prefers_color_scheme="light")
    browser.size(1280, 800)


def check_two_hubs(browser, network, folder):
    """A second hub that joins the first is shown beside it."""
    network.start("nms", "hub", "--id", "nms", "--listen", f"tcp/127.0.0.1:{free_port()}", "--connect", network.endpoint,
                  "--config", str(network.folder / "nms.toml"))
    browser.wait("window.v2x.shown.length === 2", "two hubs side by side")
    names = browser.run("window.v2x.shown.map((each) => each.hub)")
    assert names == ["hub", "nms"], names
    if folder:
        browser.size(1920, 1080)
        browser.run("new Promise((done) => setTimeout(done, 2500))")
        browser.picture(folder / "view-two-hubs.png")
        browser.size(1280, 800)
    network.end("nms")
    browser.wait("window.v2x.shown.length === 1", "one hub again")


def check_help(browser):
    browser.key("?", "?")
    browser.wait("document.getElementById('help').open && document.getElementById('keys').rows.length > 8", "the help")
    browser.key("Escape")
    browser.run("document.getElementById('help').close()")


def check_end(browser, network):
    """The view ends in order though a browser holds its stream, and the page says so."""
    network.end("view")
    browser.wait("!window.v2x.state.online && document.getElementById('verdict-word').innerText.includes('cut off')", "a page that knows that it is cut off")


def readme_picture(browser, network, path):
    network.start_hub()
    network.start_agents()
    browser.size(*README_SIZE, scale=1.5)
    browser.media(prefers_color_scheme="light")
    browser.open(network.url)
    browser.wait("window.v2x.shown.length === 1 && window.v2x.shown[0].objects > 5", "objects")
    # The charts are full after half a minute.
    browser.run("new Promise((done) => setTimeout(done, 40_000))")
    for _ in range(2):
        browser.key("+", "+")
    for _ in range(200):
        browser.key("n", "n")
        browser.run("new Promise((done) => setTimeout(done, 50))")
        if browser.run(IS_TELLING):
            break
    browser.run("new Promise((done) => setTimeout(done, 400))")
    browser.picture(path, "webp", quality=README_QUALITY)
    size = pathlib.Path(path).stat().st_size
    assert size <= 300_000, f"{size} bytes"
    print(f"{path}: {size} bytes")


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
                const s = window.v2x.stats, [shown] = window.v2x.shown, agents = document.querySelectorAll('.agent .sub span:last-child');
                const detections = [...agents].map((each) => parseInt(each.textContent) || 0);
                return `${shown.objects} objects, ${detections.reduce((a, b) => a + b)} detections of 10 agents; script ${s.median.toFixed(1)} / ${s.p95.toFixed(1)} ms,`
                    + ` drawing ${s.drawMedian.toFixed(1)} / ${s.drawP95.toFixed(1)} ms (median / p95); ${s.frames} frames; kept ${(s.memoryBytes / 1e6).toFixed(0)} MB,`
                    + ` heap ${(performance.memory.usedJSHeapSize / 1e6).toFixed(0)} MB; ${s.skipped} skipped`;
            })()""")
            cpu = sum(map(int, pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
            print(f"{line}; script {per_frame_ms:.1f} CPU ms a drawn frame (mean); launcher and view {cpu / 100:.1f} CPU s", flush=True)
        assert not browser.complaints, browser.complaints
    finally:
        process.terminate()
        process.wait(timeout=PATIENCE_S)
        log.close()


def check_all(browser, network, folder):
    check_guard(network.url)
    browser.size(1280, 800)
    check_empty_state(browser, network.url)
    network.start_hub()
    network.start_agents()
    check_picture(browser)
    published = Published(network)
    check_counts(browser, published)
    check_selection(browser)
    check_time(browser)
    check_help(browser)
    published = check_restart(browser, network)
    check_counts(browser, published)
    check_refusals(browser, network)
    check_two_hubs(browser, network, folder)
    check_widths(browser, folder)
    stats = browser.run("window.v2x.stats")
    assert not browser.complaints, browser.complaints
    check_end(browser, network)
    print(f"the live view is right; {stats['frames']} frames drawn, script {stats['median']:.1f} ms (median), {stats['p95']:.1f} ms (p95)")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("v2x", type=lambda path: str(pathlib.Path(path).resolve()))
    parser.add_argument("--screenshots", type=pathlib.Path)
    parser.add_argument("--readme", type=pathlib.Path)
    parser.add_argument("--load", type=float, metavar="SECONDS")
    args = parser.parse_args()
    if args.screenshots:
        args.screenshots.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "nms.toml").write_text('[hub]\nmethod = "nms"\n')
        network = Network(args.v2x, folder)
        browser = Browser()
        try:
            if args.load:
                measure_load(browser, args.v2x, folder, args.load)
            elif args.readme:
                readme_picture(browser, network, args.readme)
            else:
                check_all(browser, network, args.screenshots)
        finally:
            browser.end()
            network.end_all()


main()
