"""Labels on the map can be read: none lies over another one, and those of objects over no object."""

from itertools import combinations

from web_shown import NEXT_DRAWING

# Of the names of ten agents, so many may have no place but over an object.
MOST_OVER_OBJECTS = 3


def check_labels(browser):
    """In several pictures, as things move: all ten agents are named, and no two labels overlap."""
    for _ in range(5):
        labels = browser.run("window.v2x.labels")
        overlapping = [pair for pair in combinations(labels, 2) if overlap(*pair)]
        assert not overlapping, overlapping
        # Plates with agents' names are higher than labels of objects.
        names = [each for each in labels if each[3] > 11]
        assert len(names) == 10 < len(labels), labels
        assert sum(each[4] for each in labels) <= MOST_OVER_OBJECTS, [each for each in labels if each[4]]
        assert not any(each[4] for each in labels if each not in names), labels
        browser.run("new Promise((done) => setTimeout(done, 300))")
        browser.run(NEXT_DRAWING)


def overlap(one, other):
    return all(one[k] < other[k] + other[k + 2] and other[k] < one[k] + one[k + 2] for k in (0, 1))


def check_fits(browser, width):
    """A narrow window needs no scrolling: map and charts are in sight together. Nothing in the header is cut off where all is well."""
    box = "document.getElementById('{}').getBoundingClientRect()"
    if width <= 820:
        shares = browser.run(f"(() => {{ const map = {box.format('map')}, charts = {box.format('charts')};"
                             " return {map: map.height / innerHeight, charts: charts.height, end: charts.bottom - innerHeight, page: document.documentElement.scrollHeight - innerHeight}; })()")
        assert shares["map"] > 0.4 and shares["charts"] > 120 and shares["end"] <= 1 and shares["page"] <= 1, (width, shares)
        figures = browser.run("[...document.querySelectorAll('#charts figure')].map((each) => each.getBoundingClientRect().bottom <= innerHeight + 1)")
        assert len(figures) == 6 and all(figures), figures
    if browser.run("document.getElementById('verdict').dataset.level === 'good'"):
        cut = browser.run("[...document.querySelectorAll('#verdict-why, #facts dd, #facts dt')].filter((each) => each.scrollWidth > each.clientWidth + 1).map((each) => each.textContent)")
        assert not cut, f"cut off at {width}: {cut}"
