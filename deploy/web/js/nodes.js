// Elements of the page. Content is text only, never markup: names and reasons come from the network.

const SVG = "http://www.w3.org/2000/svg";

export function element(name, className, ...content) {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.append(...content);
  return made;
}

export function svgElement(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

/** How a line of a chart looks. */
export function lineSample({ colour, dash, isWide }) {
  const svg = svgElement("svg", { class: "mark", width: 20, height: 20 });
  svg.append(svgElement("line", { x1: 2, x2: 18, y1: 10, y2: 10, stroke: colour, "stroke-width": isWide ? 2.4 : 1.4, "stroke-dasharray": dash.join(" ") || "none" }));
  return svg;
}

export function button(text, action, isPressed) {
  const made = element("button", "", text);
  made.type = "button";
  made.dataset.action = action;
  made.setAttribute("aria-pressed", String(isPressed));
  return made;
}

/** A table of names and values. */
export function rows(pairs) {
  const table = element("table");
  for (const [key, value] of pairs) {
    const row = table.insertRow();
    row.append(element("td", "key", key), element("td", "", value));
  }
  return table;
}

/**
 * Makes `nodes` the content of an element. What is alike stays and gets the new text: so a press on a button, the focus and a
 * selected text outlive the next values. Listeners belong on the element itself.
 */
export function renew(root, nodes) {
  nodes.forEach((node, k) => {
    const old = root.childNodes[k];
    if (!old) root.append(node);
    else if (old.nodeName !== node.nodeName) old.replaceWith(node);
    else if (node.nodeType === Node.TEXT_NODE) { if (old.data !== node.data) old.data = node.data; }
    else renewElement(old, node);
  });
  while (root.childNodes.length > nodes.length) root.lastChild.remove();
}

function renewElement(old, node) {
  for (const { name } of [...old.attributes]) if (!node.hasAttribute(name)) old.removeAttribute(name);
  for (const { name, value } of node.attributes) if (old.getAttribute(name) !== value) old.setAttribute(name, value);
  renew(old, [...node.childNodes]);
}
