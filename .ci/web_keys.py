"""Each key of the help does what the help says."""

from web_shown import NEXT_DRAWING

CAMERA = "window.v2x.state.camera"
LAYERS = "[...document.querySelectorAll('#layers input')].map((each) => each.checked)"
SELECTED = "window.v2x.state.selection?.track"


def check_keys(browser):
    """Each key that the help lists has its effect, also in capitals, and also while the help is open."""
    browser.key("?", "?")
    browser.wait("document.getElementById('help').open", "the help by its key")
    listed = browser.run("[...document.querySelectorAll('#keys kbd')].map((each) => each.textContent)")
    browser.key("w", "w")
    browser.wait("!document.getElementById('help').open", "the help closed by another key", 5)
    checked = ["?", "Tab"]
    for check in (check_moves, check_zoom, check_selection, check_time, check_layers, check_theme):
        checked += check(browser)
    assert set(listed) - {"…"} <= set(checked), f"not checked: {set(listed) - set(checked)}"


def camera_after(browser, key):
    before = browser.run(CAMERA)
    browser.key(key, key)
    browser.run(NEXT_DRAWING)
    return before, browser.run(CAMERA)


def check_moves(browser):
    for key, axis, sign in (("w", "y", 1), ("s", "y", -1), ("a", "x", -1), ("d", "x", 1)):
        for pressed in (key, key.upper()):
            before, after = camera_after(browser, pressed)
            moved = (after[axis] - before[axis]) * sign * after["scale"]
            other = "x" if axis == "y" else "y"
            assert abs(moved - 60) < 1 and after[other] == before[other], (pressed, before, after)
    return ["w", "a", "s", "d"]


def check_zoom(browser):
    for key, is_closer in (("+", True), ("-", False)):
        before, after = camera_after(browser, key)
        assert (after["scale"] > before["scale"]) == is_closer and after["scale"] != before["scale"], (key, before, after)
    browser.key("d", "d")
    browser.key("+", "+")
    _, fitted = camera_after(browser, "0")
    inside = browser.run("""window.v2x.shown[0].tracks.every((_, k) => {
        const {x, y} = window.v2x.placeOf(k), canvas = document.getElementById('canvas');
        return x >= 0 && y >= 0 && x <= canvas.clientWidth && y <= canvas.clientHeight;
    })""")
    assert inside, f"not everything is in the picture: {fitted}"
    return ["+", "−", "0"]


def check_selection(browser):
    browser.key(" ", " ")
    browser.key("n", "n")
    first = browser.wait(SELECTED, "a selection by the key n", 5)
    browser.key("n", "n")
    browser.wait(f"{SELECTED} !== '{first}'", "the next object", 5)
    browser.key("p", "p")
    browser.wait(f"{SELECTED} === '{first}'", "the one before", 5)
    browser.key("f", "f")
    browser.wait("window.v2x.state.following", "following", 5)
    browser.key("Escape")
    browser.wait("window.v2x.state.selection === null && !window.v2x.state.following", "nothing selected", 5)
    browser.key(" ", " ")
    return ["n", "p", "f", "Esc"]


# The number of the list that is shown, once it has been the same for ten looks.
STILL = """(() => {
    const now = window.v2x.shown[0].sequence, before = window.lookedAt ?? {};
    window.lookedAt = {now, looks: before.now === now ? before.looks + 1 : 0};
    return window.lookedAt.looks >= 10 && now;
})()"""


def check_time(browser):
    browser.wait("!window.v2x.state.paused", "live before the keys of time", 5)
    browser.key(" ", " ")
    browser.wait("window.v2x.state.paused", "a pause", 5)
    # What is drawn follows the pause: by long on a busy machine.
    sequence = browser.wait(STILL, "a picture that stands still", 5)
    browser.key("ArrowLeft")
    browser.wait(f"window.v2x.shown[0].sequence < {sequence}", "a frame back", 5)
    browser.key("ArrowRight")
    browser.wait(f"window.v2x.shown[0].sequence === {sequence}", "a frame on", 5)
    browser.key("l", "l")
    browser.wait(f"!window.v2x.state.paused && window.v2x.shown[0].sequence > {sequence}", "live", 5)
    return ["Space", "←", "→", "l"]


def check_layers(browser):
    keys = "123456789cg"
    for place, key in enumerate(keys):
        before = browser.run(LAYERS)
        browser.key(key, key)
        after = browser.run(LAYERS)
        assert [k for k, _ in enumerate(before) if before[k] != after[k]] == [place], (key, before, after)
        browser.key(key, key)
    return list(keys)


def check_theme(browser):
    ground = "getComputedStyle(document.documentElement).getPropertyValue('--ground')"
    before = browser.run(ground)
    browser.key("t", "t")
    assert browser.run(ground) != before, "the theme stays"
    browser.key("t", "t")
    assert browser.run(ground) == before
    browser.run("(() => { delete document.documentElement.dataset.theme; localStorage.removeItem('v2x.theme'); })()")
    return ["t"]
