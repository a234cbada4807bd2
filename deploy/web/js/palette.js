// The colours of the project, as the style sheet gives them for dark or light.

// Okabe and Ito's hues, in a lightness in which no two of them, nor truth or fused, look alike to anybody: `.ci/web_view.py`
// computes how they look without one kind of cones. The reports have those on light, too: a test holds that.
const ON_LIGHT = ["#D55E00", "#009E73", "#DE8E06", "#4AA8E0", "#43325A", "#989DA2", "#615C04"];
const ON_DARK = ["#D55E00", "#009E73", "#E69F00", "#7CC8F5", "#7E568F", "#C0C4C8", "#F0E442"];
const NAMES = ["ground", "panel", "ink", "muted", "line", "road", "marking", "grid", "truth", "ours", "good", "warn", "bad"];

/** Colours of the agents: further ones begin again, with dots. */
export const N_COLOURS = ON_LIGHT.length;

export const palette = { agents: [] };

/** Reads the colours again: the theme has changed. */
export function readPalette() {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) palette[name] = style.getPropertyValue(`--${name}`).trim();
  palette.isDark = isDark();
  palette.tintOpacity = palette.isDark ? 0.42 : 0.8;
  palette.agents = palette.isDark ? ON_DARK : ON_LIGHT;
}

export function isDark() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

/** Changes between dark and light, and remembers it. */
export function toggleTheme() {
  const theme = isDark() ? "light" : "dark";
  document.documentElement.dataset.theme = theme;
  remember("theme", theme);
  readPalette();
}

/** Takes the remembered theme, if there is one. */
export function restoreTheme() {
  const theme = recall("theme");
  if (theme === "dark" || theme === "light") document.documentElement.dataset.theme = theme;
  readPalette();
}

// Storage can be switched off in a browser: then nothing is remembered.
export function remember(key, value) {
  try { localStorage.setItem(`v2x.${key}`, value); } catch { /* not kept */ }
}
export function recall(key) {
  try { return localStorage.getItem(`v2x.${key}`); } catch { return null; }
}
