/* View of the world on a canvas: metres about the origin of the geometry, y up; CSS pixels, y down. */
class Camera {
  constructor(box) {
    this.box = box;
    this.width = this.height = 1;
    this.fit();
  }

  resize(width, height) {
    const zoom = this.scale / this.fitScale();
    this.width = width;
    this.height = height;
    this.scale = zoom * this.fitScale();
  }

  /* Pixels per metre at which everything is visible. */
  fitScale() {
    const [left, bottom, right, top] = this.box;
    return Math.min(this.width / Math.max(right - left, 1e-300), this.height / Math.max(top - bottom, 1e-300));
  }

  fit() {
    const [left, bottom, right, top] = this.box;
    this.x = (left + right) / 2;
    this.y = (bottom + top) / 2;
    this.scale = this.fitScale();
  }

  /* Zoom about a pixel, which keeps its position. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
    this.scale = Math.min(Math.max(this.scale * factor, this.fitScale() / 4), this.fitScale() * 1000);
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  toX(x) {
    return this.width / 2 + (x - this.x) * this.scale;
  }

  toY(y) {
    return this.height / 2 - (y - this.y) * this.scale;
  }
}

/* Drawing: static geometry, then the joints and bodies of each track in its colour. */
const MIN_RADIUS = 2; // px, of a body that would be smaller
const WIDTHS = [4.5, 3, 1.7]; // px, outlines by track: each is visible under the next
const TURN = 2 * Math.PI;

class Renderer {
  constructor(context, camera, colours, unit = "m") {
    this.context = context;
    this.camera = camera;
    this.colours = colours;
    this.unit = unit;
  }

  /* The background: a grid, static geometry, and a scale bar. `absent` has times, from and until, in which a solid or
     a sensor with a number is absent. */
  drawGeometry(geometry, absent = {}, time = 0) {
    const { context, camera, colours } = this;
    context.lineCap = context.lineJoin = "round";
    context.fillStyle = colours.sheet;
    context.fillRect(0, 0, camera.width, camera.height);
    const step = this.gridStep();
    this.drawGrid(step);
    context.fillStyle = colours.pocket;
    context.beginPath();
    for (const [x, y, radius] of geometry.pockets) this.addDisc(x, y, radius);
    context.fill();
    context.fillStyle = colours.solid;
    context.strokeStyle = colours.edge;
    context.lineWidth = 1.5;
    for (const plane of geometry.planes) this.drawPlane(plane);
    for (const wall of geometry.walls) this.drawWall(wall);
    for (const [x, y, radius] of geometry.posts) {
      context.beginPath();
      this.addDisc(x, y, radius);
      context.fill();
      context.stroke();
    }
    const isPresent = (number) => !(absent[number] || []).some(([from, until]) => from <= time && (until === null || time < until));
    for (const [x, y, angle, piece, number] of geometry.solids) {
      if (!isPresent(number)) continue;
      context.beginPath();
      this.addPiece(piece, x, y, Math.cos(angle), Math.sin(angle));
      context.fill();
      context.stroke();
    }
    context.strokeStyle = colours.soft;
    context.lineWidth = 1;
    context.setLineDash([2, 3]);
    for (const [x, y, angle, piece, number] of geometry.sensors) {
      if (!isPresent(number)) continue;
      context.beginPath();
      this.addPiece(piece, x, y, Math.cos(angle), Math.sin(angle));
      context.stroke();
    }
    context.setLineDash([]);
    context.lineWidth = 1.5;
    for (const [x, y] of geometry.attractions) {
      const [px, py] = [camera.toX(x), camera.toY(y)];
      context.beginPath();
      context.arc(px, py, 4, 0, TURN);
      for (let k = 0; k < 8; k += 1) {
        const [cos, sin] = [Math.cos((k * TURN) / 8), Math.sin((k * TURN) / 8)];
        context.moveTo(px + 7 * cos, py + 7 * sin);
        context.lineTo(px + 10 * cos, py + 10 * sin);
      }
      context.stroke();
    }
    this.drawScaleBar(step);
  }

  /* Interval of the grid: 1, 2 or 5 times a power of ten metres, about 80 px. */
  gridStep() {
    const rough = 80 / this.camera.scale;
    const power = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].find((each) => each * power >= rough) * power;
  }

  drawGrid(step) {
    const { context, camera, colours } = this;
    const [wide, high] = [camera.width / 2 / camera.scale, camera.height / 2 / camera.scale];
    context.strokeStyle = colours.rule;
    context.lineWidth = 1;
    context.beginPath();
    for (let k = Math.ceil((camera.x - wide) / step); k * step <= camera.x + wide; k += 1) {
      const x = Math.round(camera.toX(k * step)) + 0.5;
      context.moveTo(x, 0);
      context.lineTo(x, camera.height);
    }
    for (let k = Math.ceil((camera.y - high) / step); k * step <= camera.y + high; k += 1) {
      const y = Math.round(camera.toY(k * step)) + 0.5;
      context.moveTo(0, y);
      context.lineTo(camera.width, y);
    }
    context.stroke();
  }

  drawScaleBar(step) {
    const { context, camera, colours } = this;
    const [right, y, length] = [camera.width - 14, 26, step * camera.scale];
    context.strokeStyle = colours.soft;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(right - length, y - 4);
    context.lineTo(right - length, y);
    context.lineTo(right, y);
    context.lineTo(right, y - 4);
    context.stroke();
    context.textAlign = "center";
    this.write(formatNumber(step, this.unit), right - length / 2, y - 6);
  }

  /* A text with an outline in the colour of the background, legible on everything. */
  write(text, x, y, colour = this.colours.soft) {
    const { context, colours } = this;
    context.font = `12px ${colours.font}`;
    context.lineWidth = 4;
    context.lineJoin = "round";
    context.strokeStyle = colours.sheet;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }

  drawPlane([x, y, nx, ny]) {
    const { context, camera } = this;
    const reach = 2 * Math.hypot(camera.width, camera.height);
    // From the point of the plane nearest to the centre of the view, so that pixels stay small wherever the plane's own point is.
    const distance = (camera.x - x) * nx + (camera.y - y) * ny;
    const [px, py] = [camera.toX(camera.x - distance * nx), camera.toY(camera.y - distance * ny)];
    if (Math.abs(distance) * camera.scale > reach) {
      if (distance < 0) context.fillRect(0, 0, camera.width, camera.height);
      return;
    }
    const corners = [
      [-reach * ny, -reach * nx],
      [reach * ny, reach * nx],
      [reach * ny - reach * nx, reach * nx + reach * ny],
      [-reach * ny - reach * nx, -reach * nx + reach * ny],
    ];
    context.beginPath();
    for (const [dx, dy] of corners) context.lineTo(px + dx, py + dy);
    context.fill();
    context.beginPath();
    context.moveTo(px + corners[0][0], py + corners[0][1]);
    context.lineTo(px + corners[1][0], py + corners[1][1]);
    context.stroke();
  }

  drawWall({ points, thickness, closed }) {
    const { context, camera, colours } = this;
    context.beginPath();
    for (const [x, y] of points) context.lineTo(camera.toX(x), camera.toY(y));
    if (closed) context.closePath();
    context.lineCap = context.lineJoin = "round";
    const wide = thickness * camera.scale;
    context.strokeStyle = colours.edge;
    context.lineWidth = Math.max(wide, 2);
    context.stroke();
    if (wide > 5) {
      context.strokeStyle = colours.solid;
      context.lineWidth = wide - 3;
      context.stroke();
      context.strokeStyle = colours.edge;
    }
    context.lineWidth = 1.5;
  }

  addDisc(x, y, radius) {
    const { context, camera } = this;
    const size = Math.max(radius * camera.scale, MIN_RADIUS);
    const [px, py] = [camera.toX(x), camera.toY(y)];
    context.moveTo(px + size, py);
    context.arc(px, py, size, 0, TURN);
  }

  /* A convex piece of a body at a pose: a disc, a capsule or a polygon. */
  addPiece(piece, x, y, cos, sin) {
    const { context, camera } = this;
    const radius = piece[0];
    const place = (k) => [x + cos * piece[k] - sin * piece[k + 1], y + sin * piece[k] + cos * piece[k + 1]];
    if (piece.length === 3) {
      const [cx, cy] = place(1);
      this.addDisc(cx, cy, radius);
      return;
    }
    if (piece.length === 5) {
      const [a, b] = [place(1), place(3)];
      const direction = Math.atan2(a[1] - b[1], b[0] - a[0]); // on the canvas, y down
      const size = Math.max(radius * camera.scale, MIN_RADIUS / 2);
      const [ax, ay, bx, by] = [camera.toX(a[0]), camera.toY(a[1]), camera.toX(b[0]), camera.toY(b[1])];
      context.moveTo(ax + size * Math.cos(direction + TURN / 4), ay + size * Math.sin(direction + TURN / 4));
      context.arc(ax, ay, size, direction + TURN / 4, direction + (3 * TURN) / 4);
      context.arc(bx, by, size, direction - TURN / 4, direction + TURN / 4);
      context.closePath();
      return;
    }
    for (let k = 1; k < piece.length; k += 2) {
      const [cx, cy] = place(k);
      if (k === 1) context.moveTo(camera.toX(cx), camera.toY(cy));
      else context.lineTo(camera.toX(cx), camera.toY(cy));
    }
    context.closePath();
  }

  /* Rings with a text at the marks of a track, from their time on for `lasting`, s. */
  drawMarks(marks, time, lasting) {
    const { context, camera, colours } = this;
    const written = [];
    for (const [at, x, y, text] of marks) {
      const age = time - at;
      if (age < -1e-4 || age > lasting) continue; // times are rounded to a few digits
      const [px, py] = [camera.toX(x), camera.toY(y)];
      context.globalAlpha = 1 - 0.6 * Math.max(age / lasting, 0);
      context.strokeStyle = colours.bad;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(px, py, 10, 0, TURN);
      context.stroke();
      // Texts near each other have a line each.
      let line = py - 16;
      while (written.some(([u, v]) => Math.abs(u - px) < 120 && Math.abs(v - line) < 14)) line -= 14;
      written.push([px, line]);
      context.textAlign = px > 0.6 * camera.width ? "right" : px < 0.4 * camera.width ? "left" : "center";
      this.write(text, Math.min(Math.max(px, 6), camera.width - 6), line, colours.bad);
    }
    context.globalAlpha = 1;
  }

  /* One track at one time. `pose` is x, y, angle of each body; x is nan for an absent one. A truth is dashed. */
  drawTrack(geometry, track, pose, bodies, time, place, truth = track.css_class === "truth") {
    const { context, camera, colours } = this;
    const colour = colours[track.css_class];
    context.save();
    context.strokeStyle = context.fillStyle = colour;
    context.lineCap = context.lineJoin = "round";
    this.drawJoints(geometry, track, pose, time, truth);
    context.beginPath();
    for (let n = 0; n < bodies; n += 1) {
      const [x, y, angle] = [pose[3 * n], pose[3 * n + 1], pose[3 * n + 2]];
      if (Number.isNaN(x)) continue;
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      const shape = geometry.shapes[track.shape ? track.shape[n] : geometry.shape[n]];
      for (const piece of shape) this.addPiece(piece, x, y, cos, sin);
      // A line from the centre shows the rotation of a body that is a single disc.
      if (shape.length === 1 && shape[0].length === 3 && track.hasAngles && !truth) {
        const radius = shape[0][0];
        if (radius * camera.scale > 5) {
          context.moveTo(camera.toX(x), camera.toY(y));
          context.lineTo(camera.toX(x + cos * radius), camera.toY(y + sin * radius));
        }
      }
    }
    const dense = bodies > 60;
    if (truth) {
      context.setLineDash(dense ? [3, 3] : [6, 5]);
      context.globalAlpha = dense ? 0.6 : 1;
      context.lineWidth = dense ? 1 : 1.6;
    } else {
      context.globalAlpha = 0.16;
      context.fill();
      context.globalAlpha = 1;
      context.lineWidth = (dense ? 0.5 : 1) * WIDTHS[Math.min(place, WIDTHS.length - 1)];
    }
    context.stroke();
    context.restore();
  }

  drawJoints(geometry, track, pose, time, truth) {
    const { context } = this;
    if (!geometry.joints.length) return;
    const springs = geometry.joints.length <= 300;
    context.lineWidth = truth ? 1 : springs ? 1.6 : 0.8;
    context.setLineDash(truth ? [4, 4] : []);
    context.globalAlpha = truth ? 0.7 : 0.85;
    context.beginPath();
    const anchors = [];
    for (const [number, symbol, a, b, ax, ay, bx, by] of geometry.joints) {
      const broken = track.breaks[number];
      if (broken !== undefined && broken <= time) continue;
      const [x, y] = this.anchor(pose, a, ax, ay);
      const [u, v] = this.anchor(pose, b, bx, by);
      if (Number.isNaN(x) || Number.isNaN(u)) continue;
      if (a < 0) anchors.push([x, y]);
      if (symbol === "pivot") anchors.push([u, v]);
      else if (symbol === "spring" && springs) this.addSpring(x, y, u, v);
      else {
        context.moveTo(x, y);
        context.lineTo(u, v);
      }
    }
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    for (const [x, y] of truth ? [] : anchors) {
      context.moveTo(x + 2.5, y);
      context.arc(x, y, 2.5, 0, TURN);
    }
    context.fill();
    context.globalAlpha = 1;
  }

  /* The anchor of a joint on a body, or in the world, px. */
  anchor(pose, body, x, y) {
    const { camera } = this;
    if (body < 0) return [camera.toX(x), camera.toY(y)];
    const [cos, sin] = [Math.cos(pose[3 * body + 2]), Math.sin(pose[3 * body + 2])];
    const [px, py] = [pose[3 * body] + cos * x - sin * y, pose[3 * body + 1] + sin * x + cos * y];
    return [camera.toX(px), camera.toY(py)];
  }

  addSpring(x, y, u, v) {
    const { context } = this;
    const length = Math.hypot(u - x, v - y);
    context.moveTo(x, y);
    if (length > 30) {
      const [dx, dy] = [(u - x) / length, (v - y) / length];
      for (let k = 0; k < 14; k += 1) {
        const along = length * (0.12 + (0.76 * (k + 0.5)) / 14);
        const aside = k % 2 ? 5 : -5;
        context.lineTo(x + dx * along - dy * aside, y + dy * along + dx * aside);
      }
    }
    context.lineTo(u, v);
  }
}
