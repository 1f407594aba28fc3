"use strict";
/* The road from above, in the coordinates of the ego. */
/* From one colour of the style sheet over another to the last, by a share in [0, 1]. */
const blend = (...names) => {
  const stops = names.map((name) => Theme.colour(name).split(",").map(Number));
  return (share) => {
    const low = Math.min(stops.length - 2, Math.floor(share * (stops.length - 1))), part = share * (stops.length - 1) - low;
    return `rgb(${stops[low].map((value, i) => Math.round(value + part * (stops[low + 1][i] - value)))})`;
  };
};

/* Whose sets bind the plan of a step, and at which of its points: the middle one of those at which they do; where it is
   not clear, whom it meets, and where; where nothing binds, what it comes nearest to. */
function binding(drive, step) {
  const points = new Map(), found = new Map(), [length, width] = drive.sizes[drive.own];
  let nearest = FAR, close = null;
  for (let path = drive.first[step]; path < drive.first[step + 1]; path++) {
    const slot = drive.vehicle[path];
    for (let point = 1; point < drive.planPoints; point++) {
      if ((drive.active[path] >> point) & 1) points.set(slot, [...points.get(slot) ?? [], point]);
      const ego = 3 * (step * drive.planPoints + point), box = 2 * point * drive.total + path;
      const along = Math.abs(drive.held[ego] - drive.paths[box]) - drive.boxes[box] - length / 2;
      const across = Math.abs(drive.held[ego + 1] - drive.paths[box + drive.total]) - drive.boxes[box + drive.total] - width / 2;
      if (Math.max(along, across) < nearest) [nearest, close] = [Math.max(along, across), [slot, point]];
    }
  }
  for (const [slot, all] of points) found.set(slot, all.sort((one, other) => one - other)[all.length >> 1]);
  if (drive.met[step] >= 0) found.set(drive.vehicle[drive.first[step] + drive.met[step]], Math.round(drive.metAt[step] / drive.planDt));
  return found.size || !close ? found : new Map([close]);
}

const FAR = 10;  // [m] from which nothing is near
const bits = (mask) => mask ? (mask & 1) + bits(mask >> 1) : 0;

class RoadView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  /* Metres behind and ahead of the ego that are shown, by the width of the page. */
  window() {
    const wide = this.canvas.clientWidth;
    return wide > 820 ? [25, 95] : wide > 520 ? [20, 80] : [12, 68];
  }

  /* At a moment of the drive; of the sets and the plan what decides ("deciding"), everything ("all"), or one time [s]
     within the horizon; of all vehicles or of one slot. */
  show(drive, moment, view) {
    const context = this.context, width = this.canvas.clientWidth, lines = drive.road.lines;
    const [behind, ahead] = this.window(), verge = 1.2, ruler = 22;
    const right = drive.road.across[0] - verge, left = drive.road.across[1] + verge;
    this.along = width / (behind + ahead);
    this.across = Math.max(this.along, (innerHeight / 3 - ruler) / (left - right));  // a third of the window at the least
    const road = Math.ceil((left - right) * this.across), height = road + ruler, ratio = devicePixelRatio || 1;
    this.canvas.style.height = height + "px";
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const step = Math.min(Math.floor(moment), drive.steps), part = moment - step;
    const now = this.now = this.vehicles(drive, step, part), origin = now[drive.own].lon - behind;
    this.place = (lon, lat) => [(lon - origin) * this.along, (left - lat) * this.across];
    this.surface(lines, height);
    context.save();
    context.beginPath();
    context.rect(0, 0, width, road);
    context.clip();
    const planned = Math.min(step, drive.steps - 1);  // the last moment has no plan of its own
    const deciding = view.within === "deciding" && view.slot === null ? binding(drive, planned) : new Map();
    this.sets(drive, planned, view, deciding);
    this.markings(lines);
    this.members(drive, planned, view);
    this.plan(drive, planned, view, deciding);
    this.met(drive, planned, view);
    now.forEach((vehicle, slot) => {
      if (!vehicle) return;
      const pale = view.slot === null ? view.within > 0 : slot !== view.slot && slot !== drive.own;
      context.globalAlpha = pale ? 0.45 : 1;  // what is now is not what is drawn around it
      if (step === drive.worst.moment && slot === drive.worst.slot) this.frame(vehicle, "bad", 7);
      if (drive.left[step * drive.slots + slot]) this.frame(vehicle, "ink", 3);
      this.body(vehicle, slot === drive.own, step === drive.steps && slot === drive.partner);
    });
    context.restore();
    this.ruler(behind, ahead, height, drive.road.bends);
  }

  /* Slots of the vehicles that are in the picture. */
  inView() {
    const shown = (vehicle) => vehicle && Math.abs(this.place(vehicle.lon, 0)[0] / this.canvas.clientWidth - 0.5) < 0.5;
    return this.now.map((vehicle, slot) => shown(vehicle) ? slot : null).filter((slot) => slot !== null);
  }

  /* The slot of the vehicle at a place [pixel] of the canvas, or near it; null for none. */
  slotAt(x, y) {
    const found = (this.now ?? []).map((vehicle, slot) => {
      if (!vehicle) return [Infinity, null];
      const [there, beside] = this.place(vehicle.lon, vehicle.lat), [length, width] = vehicle.size;
      const reach = [Math.max(14, length * this.along / 2), Math.max(14, width * this.across / 2)];
      const within = Math.abs(x - there) <= reach[0] && Math.abs(y - beside) <= reach[1];
      return [within ? Math.hypot(x - there, y - beside) : Infinity, slot];
    });
    const [far, slot] = found.reduce((best, each) => each[0] < best[0] ? each : best, [Infinity, null]);
    return far < Infinity ? slot : null;
  }

  vehicles(drive, step, part) {
    const between = (values, slot) => {
      const here = step * drive.slots + slot, next = here + drive.slots;
      return part && drive.valid[next] ? values[here] + part * (values[next] - values[here]) : values[here];
    };
    return drive.sizes.map((size, slot) => drive.valid[step * drive.slots + slot] && {
      lon: between(drive.lon, slot), lat: between(drive.lat, slot), heading: between(drive.heading, slot), speed: between(drive.speed, slot), size,
    });
  }

  /* The road lies between its first two lines, its borders. */
  surface(lines, height) {
    const context = this.context, [right, left] = lines;
    context.fillStyle = Theme.colour("paper");
    context.fillRect(0, 0, this.canvas.clientWidth, height);
    context.fillStyle = Theme.colour("road");
    context.beginPath();
    for (const point of right.points.concat(left.points.slice().reverse())) context.lineTo(...this.place(...point));
    context.fill();
  }

  markings(lines) {
    const context = this.context;
    context.strokeStyle = Theme.colour("marking");
    for (const { outer, points } of lines) {
      context.lineWidth = outer ? 1.8 : 1.3;
      context.setLineDash(outer ? [] : [3 * this.along, 9 * this.along]);
      context.lineDashOffset = outer ? 0 : points[0][0] * this.along;  // so that the dashes of all lines lie side by side
      context.beginPath();
      for (const point of points) context.lineTo(...this.place(...point));
      context.stroke();
    }
    context.setLineDash([]);
  }

  /* Where the others may be, late first, so that what is near in time lies on top; pale what does not decide, at the
     time at which something does. */
  sets(drive, step, { within, slot }, deciding) {
    const context = this.context, points = drive.points, first = drive.first[step], end = drive.first[step + 1];
    const of = (each) => (path) => each === null || drive.vehicle[path] === each;
    const boxes = (point, shown, draw) => {
      for (let path = first; path < end; path++) if (shown(path)) draw.call(context, ...this.box(drive, path, point));
    };
    const hue = blend("set-now", "set-mid", "set-late"), edge = blend("time-now", "time-mid", "time-late");
    const every = Array.from({ length: 2 * points - 1 }, (_, half) => points - 1 - half / 2);
    if (within === "all" || slot !== null && within === "deciding") {
      for (const point of every) {
        context.fillStyle = hue(point / (points - 1));
        boxes(point, of(slot), context.fillRect);
      }
      return;
    }
    if (within === "deciding") {
      context.fillStyle = Theme.colour("set-pale");
      for (const point of deciding.size ? new Set(deciding.values()) : every) boxes(point, of(null), context.fillRect);
    }
    const drawn = within === "deciding" ? [...deciding] : [[slot, within / drive.planDt]];
    for (const [each, point] of drawn) {
      context.fillStyle = hue(point / (points - 1));
      boxes(point, of(each), context.fillRect);
    }
    context.lineWidth = 1;
    context.globalAlpha = 0.5;
    for (const [each, point] of drawn) {
      context.strokeStyle = edge(point / (points - 1));
      boxes(point, of(each), context.strokeRect);
    }
    context.globalAlpha = 1;
  }

  /* Where the fail-safe branch first meets the path that it meets fastest, if it is not clear. */
  met(drive, step, { within }) {
    const context = this.context, seconds = drive.metAt[step];
    if (drive.met[step] < 0 || Math.abs(within - seconds) > drive.planDt / 2) return;  // of a name nothing is far
    context.strokeStyle = Theme.colour("bad");
    context.lineWidth = 2;
    context.setLineDash([4, 3]);
    context.strokeRect(...this.box(drive, drive.first[step] + drive.met[step], seconds / drive.planDt));
    this.outline(this.planned(drive, drive.held, step, seconds / drive.planDt));
    context.stroke();
    context.setLineDash([]);
  }

  /* One line for every predicted path, and the boxes that are active constraints of the plan, in the hue of
     their time. */
  members(drive, step, { within, slot }) {
    const context = this.context, points = drive.points, first = drive.first[step], end = drive.first[step + 1];
    context.lineWidth = 1;
    for (const active of [false, true]) {
      context.strokeStyle = Theme.colour(active ? "active" : "other");
      context.globalAlpha = active ? 0.6 : Math.min(0.35, 24 / (end - first));
      for (let path = first; path < end; path++) {
        if (Boolean(drive.active[path]) !== active || (slot !== null && drive.vehicle[path] !== slot)) continue;
        if (within === "deciding" && slot === null && !active) continue;
        context.beginPath();
        for (let point = 0; point < points; point++) context.lineTo(...this.place(drive.paths[2 * point * drive.total + path], drive.paths[(2 * point + 1) * drive.total + path]));
        context.stroke();
      }
    }
    context.globalAlpha = 1;
    if (within === "deciding") return;
    let outlines = 0;
    for (let path = first; path < end; path++) outlines += bits(drive.active[path]);
    context.globalAlpha = Math.max(0.15, Math.min(1, 10 / outlines));
    const hue = blend("time-now", "time-mid", "time-late");
    context.lineWidth = 1.4;
    for (let path = first; path < end; path++) {
      for (let point = 1; drive.active[path] >> point; point++) {
        const shown = within === "all" || Math.abs(within - point * drive.planDt) <= drive.planDt / 2;
        if (!shown || !((drive.active[path] >> point) & 1) || (slot !== null && drive.vehicle[path] !== slot)) continue;
        context.strokeStyle = hue(point / (points - 1));
        context.strokeRect(...this.box(drive, path, point));
      }
    }
    context.globalAlpha = 1;
  }

  /* The box of a path at a point, or between two. */
  box(drive, path, point) {
    const low = Math.floor(point), high = Math.ceil(point), part = point - low;
    const at = (values, k) => (1 - part) * values[(2 * low + k) * drive.total + path] + part * values[(2 * high + k) * drive.total + path];
    const [halfLength, halfWidth] = [at(drive.boxes, 0), at(drive.boxes, 1)];
    const [x, y] = this.place(at(drive.paths, 0) - halfLength, at(drive.paths, 1) + halfWidth);
    return [x, y, 2 * halfLength * this.along, 2 * halfWidth * this.across];
  }

  /* The ego at a point of a branch, or between two. */
  planned(drive, branch, step, point) {
    const low = Math.floor(point), high = Math.ceil(point), part = point - low;
    const at = (k) => (1 - part) * branch[3 * (step * drive.planPoints + low) + k] + part * branch[3 * (step * drive.planPoints + high) + k];
    return { lon: at(0), lat: at(1), heading: at(2), size: drive.sizes[drive.own] };
  }

  /* The drive branch, dotted at its steps, and the fail-safe branch, dashed, with the body on the latter where a set
     decides, or at every second, or at one time on both. */
  plan(drive, step, { within }, deciding) {
    const context = this.context, points = drive.planPoints;
    const spot = ({ lon, lat }) => this.place(lon, lat);
    context.strokeStyle = context.fillStyle = Theme.colour("own");
    context.lineWidth = 2;
    for (const [branch, dashes] of [[drive.plan, []], [drive.held, [5, 4]]]) {
      context.setLineDash(dashes);
      context.beginPath();
      for (let point = 0; point < points; point++) context.lineTo(...spot(this.planned(drive, branch, step, point)));
      context.stroke();
      if (typeof within === "number") {
        this.outline(this.planned(drive, branch, step, within / drive.planDt));
        context.stroke();
      }
    }
    context.setLineDash([]);
    context.lineWidth = 1.6;
    const hue = blend("time-now", "time-mid", "time-late");
    for (let point = 1; point < points; point++) {
      context.beginPath();
      context.arc(...spot(this.planned(drive, drive.plan, step, point)), 2.2, 0, 7);
      context.fill();
    }
    const whole = (point) => Math.abs(point * drive.planDt - Math.round(point * drive.planDt)) < 1e-6;
    const seconds = Array.from({ length: points - 1 }, (_, point) => point + 1).filter(whole);
    const ghosts = within === "all" ? seconds : within === "deciding" ? new Set(deciding.values()) : [];
    context.font = "600 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    for (const point of ghosts) {
      const ghost = this.planned(drive, drive.held, step, point), [x, y] = spot(ghost);
      context.strokeStyle = context.fillStyle = hue(point / (points - 1));
      this.outline(ghost);
      context.stroke();
      if (within === "deciding") context.fillText(`+${(point * drive.planDt).toFixed(1)} s`, x, y - ghost.size[1] * this.across / 2 - 5);
    }
  }

  outline({ lon, lat, heading, size }) {
    const context = this.context, [x, y] = this.place(lon, lat);
    context.save();
    context.translate(x, y);
    context.scale(this.along, this.across);
    context.rotate(-heading);
    context.beginPath();
    context.roundRect(-size[0] / 2, -size[1] / 2, size[0], size[1], 2 / this.across);
    context.restore();
  }

  /* Around a vehicle, in a colour: that it has left its predicted set, or is who the worst moment is about. */
  frame({ lon, lat, heading, size }, colour, pixels) {
    const context = this.context;
    context.strokeStyle = Theme.colour(colour);
    context.lineWidth = 2 * pixels;
    this.outline({ lon, lat, heading, size });
    context.stroke();
  }

  body(vehicle, own, hit) {
    const context = this.context;
    context.fillStyle = Theme.colour(own ? "own" : hit ? "bad" : "other");
    context.strokeStyle = Theme.colour("body-edge");
    context.lineWidth = 1;
    this.outline(vehicle);
    context.fill();
    context.stroke();
    if (vehicle.size[0] * this.along < 16) return;
    context.fillStyle = Theme.colour("on-body");
    context.font = `600 ${Math.min(12, 0.75 * vehicle.size[1] * this.across)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const speed = vehicle.speed.toFixed(0), [x, y] = this.place(vehicle.lon, vehicle.lat), half = context.measureText(speed).width / 2;
    if (x > half && x < this.canvas.clientWidth - half) context.fillText(speed, x, y);  // half a number is another one
  }

  ruler(behind, ahead, height, bends) {
    const context = this.context;
    context.fillStyle = Theme.colour("soft");
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    const wide = this.across / this.along, width = this.canvas.clientWidth;
    const said = [...(bends ? ["unrolled"] : []), ...(wide > 1.05 ? [`stretched ${wide.toFixed(1)} times across`] : [])].join(", ");
    const free = width - (said ? context.measureText(said).width + 36 : 20);
    for (let metre = -20; (metre + behind) * this.along < free; metre += 20) {
      if (metre > -behind + 2) context.fillText(metre === 0 ? "ego" : `${metre > 0 ? "+" : "−"}${Math.abs(metre)} m`, (metre + behind) * this.along, height - 7);
    }
    context.textAlign = "right";
    context.fillText(said, width - 6, height - 7);
  }
}
