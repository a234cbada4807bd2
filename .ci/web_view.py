"""The live view in a headless Chromium, over a real network.

Usage: web_view.py V2X [--screenshots FOLDER] [--readme FILE] [--load SECONDS]

V2X is the built program, such as target/debug/v2x. Starts a hub, two agents and the view as processes, opens the page, and
checks what it shows against what the hub published, and that it can be used by mouse, finger and keyboard. With --screenshots
it writes the page at three widths in light and dark; with --readme only the picture of the README is made; with --load only
script time and memory under load are measured, and the exit code is 1 where a drawn frame takes more than 8 ms of the
processor. Needs Chromium and the packages `websockets` and `eclipse-zenoh`.
"""

import argparse
import pathlib
import tempfile

import web_shown as shown
import web_used as used
from chromium import Browser
from web_keys import check_keys
from web_labels import check_fits
from web_load import measure_load
from web_network import Network, Published, free_port

WIDTHS = [(400, 860), (800, 900), (900, 800), (1920, 1080)]
# The README's picture: as wide as GitHub shows it, with twice the pixels.
README_SIZE = (1280, 840)
README_QUALITY = 82

# A car in motion that both agents see, in the picture as they are, and not an agent itself.
IS_GOOD_EXAMPLE = """(() => {
    const {selection, contributors} = window.v2x.state;
    const text = document.getElementById('selected-body').innerText;
    const k = window.v2x.shown[0].tracks.indexOf(selection?.track);
    if (k < 0 || contributors.length < 2 || !text.includes('vehicle.car')) return false;
    const {x, y} = window.v2x.placeOf(k);
    const canvas = document.getElementById('canvas');
    const isInside = (x, y) => x > 90 && y > 60 && x < canvas.clientWidth - 120 && y < canvas.clientHeight - 60;
    const areInside = [{x, y}, ...window.v2x.agentPlaces].every((place) => isInside(place.x, place.y));
    const isApart = window.v2x.agentPlaces.every((place) => Math.hypot(place.x - x, place.y - y) > 60);
    return areInside && isApart && Number(/speed\\sm\\/s\\s+([\\d.]+)/.exec(text)?.[1]) > 2;
})()"""


def check_widths(browser, folder):
    for width, height in WIDTHS:
        browser.size(width, height)
        for scheme in ("light", "dark"):
            browser.media(prefers_color_scheme=scheme)
            browser.wait(f"document.getElementById('canvas').clientWidth > 0 && innerWidth === {width}", "the size")
            browser.run("new Promise((done) => setTimeout(done, 700))" if folder else shown.NEXT_DRAWING)
            overflow = browser.run("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            assert overflow <= 0, f"{overflow} pixels too wide at {width}"
            assert browser.run("document.getElementById('canvas').clientHeight") > 200
            check_fits(browser, width)
            if folder:
                browser.picture(folder / f"view-{width}-{scheme}.png")
    browser.media(prefers_color_scheme="light")
    browser.size(1280, 800)


def select_example(browser):
    """Selects an object of which the panel has much to say, if there is one."""
    for _ in range(1000):
        browser.key("n", "n")
        browser.run("new Promise((done) => setTimeout(done, 50))")
        if browser.run(IS_GOOD_EXAMPLE):
            break
    browser.run("new Promise((done) => setTimeout(done, 400))")


def readme_picture(browser, network, path):
    network.start_hub()
    network.start_agents()
    browser.size(*README_SIZE, scale=1.5)
    browser.media(prefers_color_scheme="light")
    browser.open(network.url)
    browser.wait("window.v2x.shown.length === 1 && window.v2x.shown[0].objects > 5", "objects")
    # The charts are full after half a minute.
    browser.run("new Promise((done) => setTimeout(done, 40_000))")
    browser.key("+", "+")
    select_example(browser)
    browser.picture(path, "webp", quality=README_QUALITY)
    size = pathlib.Path(path).stat().st_size
    assert size <= 300_000, f"{size} bytes"
    print(f"{path}: {size} bytes")


def check_all(browser, network, folder):
    shown.check_guard(network.url)
    browser.size(1280, 800)
    shown.check_empty_state(browser, network.url)
    network.start_hub()
    network.start_agents()
    shown.check_picture(browser)
    shown.check_counts(browser, Published(network))
    shown.check_selection(browser)
    shown.check_time(browser)
    shown.check_help(browser)
    check_keys(browser)
    used.check_press(browser)
    used.check_follow(browser)
    used.check_touch(browser)
    used.check_charts_by_touch(browser)
    used.check_charts(browser)
    used.check_one_moment(browser)
    published = shown.check_restart(browser, network)
    shown.check_counts(browser, published)
    shown.check_refusals(browser, network, meanwhile=used.check_motion)
    stats = browser.run("window.v2x.stats")
    used.check_two_hubs(browser, network, free_port, folder)
    shown.check_recovery(browser)
    check_widths(browser, folder)
    if folder:
        browser.size(1920, 1080)
        select_example(browser)
        browser.picture(folder / "view-selected.png")
        browser.key("Escape")
        browser.size(1280, 800)
    used.check_markup(browser, network)
    shown.check_end(browser, network)
    # The stream of events was cut off on purpose.
    complaints = [each for each in browser.complaints if "ERR_CONNECTION_REFUSED" not in each]
    assert not complaints, complaints
    network.end_all()
    used.check_ten_agents(browser, network.v2x, network.folder, folder)
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
