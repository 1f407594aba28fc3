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

class RoadView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  /* Metres behind and ahead of the ego that are shown, by the width of the page. */
  window() {
    const wide = this.canvas.clientWidth;
    return wide > 820 ? [35, 105] : wide > 520 ? [25, 80] : [12, 68];
  }

  show(drive, moment) {
    const context = this.context, width = this.canvas.clientWidth, edges = drive.edges;
    const [behind, ahead] = this.window(), verge = 2, ruler = 22;
    const right = edges[0] - verge, left = edges[edges.length - 1] + verge;
    this.along = width / (behind + ahead);
    this.across = width > 520 ? this.along : Math.max(this.along, 160 / (left - right));  // a narrow page stretches the road
    const road = Math.round((left - right) * this.across), height = road + ruler, ratio = devicePixelRatio || 1;
    this.canvas.style.height = height + "px";
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const step = Math.min(Math.floor(moment), drive.steps), part = moment - step;
    const now = this.vehicles(drive, step, part), origin = now[drive.own].lon - behind;
    this.place = (lon, lat) => [(lon - origin) * this.along, (left - lat) * this.across];
    this.surface(edges, height);
    context.save();
    context.beginPath();
    context.rect(0, 0, width, road);
    context.clip();
    const planned = Math.min(step, drive.steps - 1);  // the last moment has no plan of its own
    this.sets(drive, planned);
    this.markings(edges, origin);
    this.members(drive, planned);
    this.plan(drive, planned);
    now.forEach((vehicle, slot) => vehicle && drive.left[step * drive.slots + slot] && this.frame(vehicle));
    now.forEach((vehicle, slot) => vehicle && this.body(vehicle, slot === drive.own, step === drive.steps && slot === drive.partner));
    context.restore();
    this.ruler(behind, ahead, height);
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

  surface(edges, height) {
    const context = this.context, width = this.canvas.clientWidth;
    const left = this.place(0, edges[edges.length - 1])[1], right = this.place(0, edges[0])[1];
    context.fillStyle = Theme.colour("paper");
    context.fillRect(0, 0, width, height);
    context.fillStyle = Theme.colour("road");
    context.fillRect(0, left, width, right - left);
  }

  markings(edges, origin) {
    const context = this.context, width = this.canvas.clientWidth;
    const lines = edges.map((lat) => this.place(0, lat)[1]);
    context.strokeStyle = Theme.colour("marking");
    lines.forEach((y, number) => {
      const outer = number === 0 || number === lines.length - 1;
      context.lineWidth = outer ? 1.8 : 1.3;
      context.setLineDash(outer ? [] : [3 * this.along, 9 * this.along]);
      context.lineDashOffset = outer ? 0 : (origin % 12) * this.along;
      context.beginPath();
      context.moveTo(0, y);
      context.lineTo(width, y);
      context.stroke();
    });
    context.setLineDash([]);
  }

  /* Where the others may be, late first, so that what is near in time lies on top. */
  sets(drive, step) {
    const context = this.context, points = drive.points, first = drive.first[step], end = drive.first[step + 1];
    const hue = blend("set-now", "set-mid", "set-late");
    for (let point = 2 * (points - 1); point >= 0; point--) {
      context.fillStyle = hue(point / (2 * (points - 1)));
      for (let path = first; path < end; path++) context.fillRect(...this.box(drive, path, point / 2));
    }
  }

  /* One line for every predicted path, and the boxes that are active constraints of the plan. */
  members(drive, step) {
    const context = this.context, points = drive.points, first = drive.first[step], end = drive.first[step + 1];
    context.lineWidth = 1;
    for (const active of [false, true]) {
      context.strokeStyle = Theme.colour(active ? "active" : "other");
      context.globalAlpha = active ? 0.6 : Math.min(0.35, 24 / (end - first));
      for (let path = first; path < end; path++) {
        if (Boolean(drive.active[path]) !== active) continue;
        context.beginPath();
        for (let point = 0; point < points; point++) context.lineTo(...this.place(drive.paths[2 * point * drive.total + path], drive.paths[(2 * point + 1) * drive.total + path]));
        context.stroke();
      }
    }
    const bits = (mask) => mask ? (mask & 1) + bits(mask >> 1) : 0;
    let outlines = 0;
    for (let path = first; path < end; path++) outlines += bits(drive.active[path]);
    context.globalAlpha = Math.max(0.15, Math.min(1, 10 / outlines));
    context.strokeStyle = Theme.colour("active");
    context.lineWidth = 1.4;
    for (let path = first; path < end; path++) {
      for (let point = 1; drive.active[path] >> point; point++) {
        if ((drive.active[path] >> point) & 1) context.strokeRect(...this.box(drive, path, point));
      }
    }
    context.globalAlpha = 1;
  }

  /* The box of a path at a point, or halfway between two. */
  box(drive, path, point) {
    const low = Math.floor(point), high = Math.ceil(point);
    const at = (values, k) => (values[(2 * low + k) * drive.total + path] + values[(2 * high + k) * drive.total + path]) / 2;
    const [halfLength, halfWidth] = [at(drive.boxes, 0), at(drive.boxes, 1)];
    const [x, y] = this.place(at(drive.paths, 0) - halfLength, at(drive.paths, 1) + halfWidth);
    return [x, y, 2 * halfLength * this.along, 2 * halfWidth * this.across];
  }

  /* The drive branch, dotted at its steps, and the fail-safe branch, dashed, with the body at every second. */
  plan(drive, step) {
    const context = this.context, size = drive.sizes[drive.own];
    const state = (branch, point) => [0, 1, 2].map((k) => branch[3 * (step * drive.planPoints + point) + k]);
    context.strokeStyle = context.fillStyle = Theme.colour("own");
    context.lineWidth = 2;
    for (const [branch, dashes] of [[drive.plan, []], [drive.held, [5, 4]]]) {
      context.setLineDash(dashes);
      context.beginPath();
      for (let point = 0; point < drive.planPoints; point++) context.lineTo(...this.place(...state(branch, point).slice(0, 2)));
      context.stroke();
    }
    context.setLineDash([]);
    context.lineWidth = 1.6;
    const hue = blend("time-now", "time-mid", "time-late");
    for (let point = 1; point < drive.planPoints; point++) {
      const [lon, lat, heading] = state(drive.held, point), seconds = point * drive.planDt;
      context.beginPath();
      context.arc(...this.place(...state(drive.plan, point).slice(0, 2)), 2.2, 0, 7);
      context.fill();
      if (Math.abs(seconds - Math.round(seconds)) < 1e-6) {
        context.strokeStyle = hue(point / (drive.planPoints - 1));
        this.outline({ lon, lat, heading, size });
        context.stroke();
      }
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

  /* Of a vehicle that has left its predicted set. */
  frame({ lon, lat, heading, size }) {
    this.context.fillStyle = Theme.colour("ink");
    this.outline({ lon, lat, heading, size: size.map((length) => length + 0.9) });
    this.context.fill();
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
    context.fillStyle = "#ffffff";
    context.font = `600 ${Math.min(12, 0.75 * vehicle.size[1] * this.across)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(vehicle.speed.toFixed(0), ...this.place(vehicle.lon, vehicle.lat));
  }

  ruler(behind, ahead, height) {
    const context = this.context;
    context.fillStyle = Theme.colour("soft");
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    for (let metre = -20; metre < ahead - 5; metre += 20) {
      if (metre > -behind + 2) context.fillText(metre === 0 ? "ego" : `${metre > 0 ? "+" : "−"}${Math.abs(metre)} m`, (metre + behind) * this.along, height - 7);
    }
  }
}
