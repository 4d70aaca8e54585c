/* Where in the world a canvas looks: metres about the scenery's own origin, y up; pixels are those of CSS, y down. */
class Camera {
  constructor(box) {
    this.box = box;
    this.width = this.height = 1;
    this.fit();
  }

  resize(width, height) {
    const share = this.scale / this.least();
    this.width = width;
    this.height = height;
    this.scale = share * this.least();
  }

  /* Pixels a metre at which all is seen. */
  least() {
    const [left, bottom, right, top] = this.box;
    return Math.min(this.width / Math.max(right - left, 1e-300), this.height / Math.max(top - bottom, 1e-300));
  }

  fit() {
    const [left, bottom, right, top] = this.box;
    this.x = (left + right) / 2;
    this.y = (bottom + top) / 2;
    this.scale = this.least();
  }

  /* Zoom about a pixel, which stays where it is. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
    this.scale = Math.min(Math.max(this.scale * factor, this.least() / 4), this.least() * 1000);
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  across(x) {
    return this.width / 2 + (x - this.x) * this.scale;
  }

  up(y) {
    return this.height / 2 - (y - this.y) * this.scale;
  }
}
