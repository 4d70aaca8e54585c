/* Drawing: fixed things once a picture, then each track's joints and bodies in its colour. */
const SMALLEST = 2; // px, radius of a body that would be smaller
const WIDTHS = [4.5, 3, 1.7]; // px, outlines from the first track on: each shows under the next
const TURN = 2 * Math.PI;

class Painter {
  constructor(context, camera, colours) {
    this.context = context;
    this.camera = camera;
    this.colours = colours;
  }

  /* The ground: paper, a grid, what is solid, and a bar that says how long a metre is. */
  drawScenery(scenery) {
    const { context, camera, colours } = this;
    context.lineCap = context.lineJoin = "round";
    context.fillStyle = colours.sheet;
    context.fillRect(0, 0, camera.width, camera.height);
    const step = this.gridStep();
    this.drawGrid(step);
    context.fillStyle = colours.pocket;
    context.beginPath();
    for (const [x, y, radius] of scenery.pockets) this.addDisc(x, y, radius);
    context.fill();
    context.fillStyle = colours.solid;
    context.strokeStyle = colours.edge;
    context.lineWidth = 1.5;
    for (const plane of scenery.planes) this.drawPlane(plane);
    for (const wall of scenery.walls) this.drawWall(wall);
    for (const [x, y, radius] of scenery.posts) {
      context.beginPath();
      this.addDisc(x, y, radius);
      context.fill();
      context.stroke();
    }
    for (const [x, y, angle, piece] of scenery.solids) {
      context.beginPath();
      this.addPiece(piece, x, y, Math.cos(angle), Math.sin(angle));
      context.fill();
      context.stroke();
    }
    context.strokeStyle = colours.soft;
    for (const [x, y] of scenery.attractions) {
      const [px, py] = [camera.across(x), camera.up(y)];
      context.beginPath();
      context.arc(px, py, 4, 0, TURN);
      for (let k = 0; k < 8; k += 1) {
        const [cos, sin] = [Math.cos((k * TURN) / 8), Math.sin((k * TURN) / 8)];
        context.moveTo(px + 7 * cos, py + 7 * sin);
        context.lineTo(px + 10 * cos, py + 10 * sin);
      }
      context.stroke();
    }
    this.drawBar(step);
  }

  /* 1, 2 or 5 times a power of ten metres, some 80 px. */
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
      const x = Math.round(camera.across(k * step)) + 0.5;
      context.moveTo(x, 0);
      context.lineTo(x, camera.height);
    }
    for (let k = Math.ceil((camera.y - high) / step); k * step <= camera.y + high; k += 1) {
      const y = Math.round(camera.up(k * step)) + 0.5;
      context.moveTo(0, y);
      context.lineTo(camera.width, y);
    }
    context.stroke();
  }

  drawBar(step) {
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
    this.write(worded(step, "m"), right - length / 2, y - 6);
  }

  /* A text with a rim of paper, to be read over anything. */
  write(text, x, y) {
    const { context, colours } = this;
    context.font = `12px ${colours.font}`;
    context.lineWidth = 4;
    context.lineJoin = "round";
    context.strokeStyle = colours.sheet;
    context.strokeText(text, x, y);
    context.fillStyle = colours.soft;
    context.fillText(text, x, y);
  }

  drawPlane([x, y, nx, ny]) {
    const { context, camera } = this;
    const reach = 2 * Math.hypot(camera.width, camera.height);
    // From the foot of the middle of the picture, so that pixels stay small however far off the plane's point is.
    const away = (camera.x - x) * nx + (camera.y - y) * ny;
    const [px, py] = [camera.across(camera.x - away * nx), camera.up(camera.y - away * ny)];
    if (Math.abs(away) * camera.scale > reach) {
      if (away < 0) context.fillRect(0, 0, camera.width, camera.height);
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
    for (const [x, y] of points) context.lineTo(camera.across(x), camera.up(y));
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
    const size = Math.max(radius * camera.scale, SMALLEST);
    const [px, py] = [camera.across(x), camera.up(y)];
    context.moveTo(px + size, py);
    context.arc(px, py, size, 0, TURN);
  }

  /* A convex piece of a body at a place, turned: a disc, a capsule or a polygon. */
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
      const way = Math.atan2(a[1] - b[1], b[0] - a[0]); // of the picture, y down
      const size = Math.max(radius * camera.scale, SMALLEST / 2);
      const [ax, ay, bx, by] = [camera.across(a[0]), camera.up(a[1]), camera.across(b[0]), camera.up(b[1])];
      context.moveTo(ax + size * Math.cos(way + TURN / 4), ay + size * Math.sin(way + TURN / 4));
      context.arc(ax, ay, size, way + TURN / 4, way + (3 * TURN) / 4);
      context.arc(bx, by, size, way - TURN / 4, way + TURN / 4);
      context.closePath();
      return;
    }
    for (let k = 1; k < piece.length; k += 2) {
      const [cx, cy] = place(k);
      if (k === 1) context.moveTo(camera.across(cx), camera.up(cy));
      else context.lineTo(camera.across(cx), camera.up(cy));
    }
    context.closePath();
  }

  /* One track at one moment. `pose` is x, y, angle of each body; x is nan where one is not there. */
  drawTrack(scenery, track, pose, bodies, time, place) {
    const { context, camera, colours } = this;
    const colour = colours[track.look];
    const truth = track.look === "truth";
    context.save();
    context.strokeStyle = context.fillStyle = colour;
    context.lineCap = context.lineJoin = "round";
    this.drawLinks(scenery, track, pose, time, truth);
    context.beginPath();
    for (let n = 0; n < bodies; n += 1) {
      const [x, y, angle] = [pose[3 * n], pose[3 * n + 1], pose[3 * n + 2]];
      if (Number.isNaN(x)) continue;
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      const form = scenery.forms[scenery.kind[n]];
      for (const piece of form) this.addPiece(piece, x, y, cos, sin);
      // A line from the centre shows how a lone disc turns, where it does.
      if (form.length === 1 && form[0].length === 3 && track.turns && !truth) {
        const radius = form[0][0];
        if (radius * camera.scale > 5) {
          context.moveTo(camera.across(x), camera.up(y));
          context.lineTo(camera.across(x + cos * radius), camera.up(y + sin * radius));
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

  drawLinks(scenery, track, pose, time, truth) {
    const { context } = this;
    if (!scenery.links.length) return;
    const springs = scenery.links.length <= 300;
    context.lineWidth = truth ? 1 : springs ? 1.6 : 0.8;
    context.setLineDash(truth ? [4, 4] : []);
    context.globalAlpha = truth ? 0.7 : 0.85;
    context.beginPath();
    const nails = [];
    for (const [number, look, a, b, ax, ay, bx, by] of scenery.links) {
      const broken = track.breaks[number];
      if (broken !== undefined && broken <= time) continue;
      const [x, y] = this.held(pose, a, ax, ay);
      const [u, v] = this.held(pose, b, bx, by);
      if (Number.isNaN(x) || Number.isNaN(u)) continue;
      if (a < 0) nails.push([x, y]);
      if (look === "pivot") nails.push([u, v]);
      else if (look === "spring" && springs) this.addSpring(x, y, u, v);
      else {
        context.moveTo(x, y);
        context.lineTo(u, v);
      }
    }
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    for (const [x, y] of truth ? [] : nails) {
      context.moveTo(x + 2.5, y);
      context.arc(x, y, 2.5, 0, TURN);
    }
    context.fill();
    context.globalAlpha = 1;
  }

  /* Where a joint holds a body, or the world, px. */
  held(pose, body, x, y) {
    const { camera } = this;
    if (body < 0) return [camera.across(x), camera.up(y)];
    const [cos, sin] = [Math.cos(pose[3 * body + 2]), Math.sin(pose[3 * body + 2])];
    const [px, py] = [pose[3 * body] + cos * x - sin * y, pose[3 * body + 1] + sin * x + cos * y];
    return [camera.across(px), camera.up(py)];
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
