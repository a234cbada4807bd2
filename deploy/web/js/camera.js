// Which part of the map is seen.

const CLOSEST = 200;
const FARTHEST = 0.02;
/** Pixels of a metre. */
const COARSE = 4;

export class Camera {
  x = 0;
  y = 0;
  /** Pixels of a metre. */
  scale = 4;
  /** Whether the user has moved it: then it is not fitted by itself any more. */
  moved = false;

  /** Whether a car is so few pixels that what is fine would only make a blot of it. */
  get isCoarse() { return this.scale < COARSE; }

  zoom(factor, atX = 0, atY = 0) {
    const scale = Math.min(CLOSEST, Math.max(FARTHEST, this.scale * factor));
    // The point under the pointer stays; `at` is from the middle of the picture, in pixels.
    this.x += atX / this.scale - atX / scale;
    this.y -= atY / this.scale - atY / scale;
    this.scale = scale;
    this.moved = true;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.moved = true;
  }

  /** Shows bounds in a picture, with so many pixels left free below them. */
  fit(bounds, width, height, below) {
    const { left, right, bottom, top } = bounds;
    this.x = (left + right) / 2;
    this.y = (bottom + top) / 2;
    const scale = Math.min(width / Math.max(right - left, 20), (height - below) / Math.max(top - bottom, 20)) * 0.97;
    this.scale = Math.min(30, Math.max(FARTHEST, scale));
    this.y -= below / 2 / this.scale;
    this.moved = false;
  }
}
