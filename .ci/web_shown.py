"""What the page of the live view shows is what the hub published."""

import re
import time
import urllib.error
import urllib.request

from web_network import PATIENCE_S, SCENARIO, Published

# Until what was just changed has been drawn.
NEXT_DRAWING = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


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
    # Without labels, which have the colour of the boxes; and near, where no line is thinner than a pixel.
    browser.key("8", "8")
    browser.key("+", "+")
    browser.run(NEXT_DRAWING)
    # An agent whose newest frame is old is drawn faintly.
    end, colours = time.monotonic() + PATIENCE_S, {"none": 0}
    while not all(count > 20 for count in colours.values()):
        assert time.monotonic() < end, colours
        colours = browser.run(count)
    # The key of a layer takes its boxes away, and brings them back.
    browser.key("1", "1")
    browser.run(NEXT_DRAWING)
    hidden = browser.run(count)
    assert hidden["ours"] < colours["ours"] / 10, (colours, hidden)
    browser.key("1", "1")
    browser.key("8", "8")
    browser.key("0", "0")


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
    # What was on its way when it was paused may still be drawn: a click that misses is made again.
    for k in [k for k in range(n_objects) for _ in range(3)]:
        place = browser.run(f"(() => {{ const p = window.v2x.placeOf({k}), box = document.getElementById('canvas').getBoundingClientRect();"
                            " return {x: p.x + box.left, y: p.y + box.top, in: p.x > 20 && p.y > 20 && p.x < box.width - 60 && p.y < box.height - 20}; })()")
        if not place["in"]:
            continue
        browser.click(place["x"], place["y"])
        if not browser.becomes("window.v2x.state.selection", patience_s=3):
            continue
        state = browser.run("window.v2x.state")
        if len(state["contributors"]) >= 2 and all(each["isDrawn"] for each in state["contributors"]):
            break
    else:
        raise AssertionError("no object with two contributors could be selected")
    n_rows = 1 + len(state["contributors"])
    browser.wait(f"document.getElementById('contributors')?.rows.length === {n_rows}", f"the list of contributors, {n_rows} rows")
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


def check_refusals(browser, network, meanwhile):
    """Frames that are too late flash at their agent with the reason, and the verdict names it."""
    slow = re.sub(r"delay_ms = \d+", "delay_ms = 1500", SCENARIO.read_text())
    (network.folder / "slow.toml").write_text(slow)
    network.end("rsu")
    network.start("rsu", "agent", "--scenario", "slow.toml", "--id", "rsu", "--connect", network.endpoint)
    browser.wait("window.v2x.state.events.some((each) => each.agent === 'rsu' && each.level === 'refused' && each.text.includes('late'))", "a refusal with its reason")
    browser.wait("document.getElementById('verdict').innerText.includes('Frames refused') && document.getElementById('verdict').innerText.includes('rsu')", "a verdict of refused frames")
    browser.wait("parseInt(document.querySelector('#facts div:last-child dd').textContent) > 0", "refused frames of the last minute in the header")
    meanwhile(browser)
    network.end("rsu")
    network.start_agent("rsu")


def check_recovery(browser):
    browser.wait("document.getElementById('verdict').dataset.level === 'good'", "a good verdict after the refusals")


def check_help(browser):
    browser.key("?", "?")
    browser.wait("document.getElementById('help').open && document.getElementById('keys').rows.length > 8", "the help")
    browser.key("Escape")
    browser.run("document.getElementById('help').close()")


def check_end(browser, network):
    """The view ends in order though a browser holds its stream, and the page says so."""
    network.end("view")
    browser.wait("!window.v2x.state.online && document.getElementById('verdict-word').innerText.includes('cut off')", "a page that knows that it is cut off")
