"use strict";
/* The course of a drive over time, with a cursor shared by all panels: gap and time to collision on scales of ratios,
   speed, planning time, severity, and how many vehicles are outside their sets. */
const NONE = 99.5;  // [m], [s] from which a gap or a time to collision is none
class CourseView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.still = document.createElement("canvas");
  }

  /* Draws what does not move; `show` puts the cursor over it. */
  prepare(drive) {
    const width = this.canvas.clientWidth, ratio = devicePixelRatio || 1;
    this.drive = drive;
    this.columns = width > 860 ? 2 : 1;
    this.panels = this.describe(drive);
    const rows = this.panels.length / this.columns, tall = this.columns > 1 ? 104 : 84, pitch = tall + 40;
    this.width = width / this.columns;
    this.height = rows * pitch + 26;
    this.panels.forEach((panel, number) => {
      const column = Math.floor(number / rows);
      Object.assign(panel, { left: column * this.width + 46, right: (column + 1) * this.width - 18, top: 26 + (number % rows) * pitch, tall });
    });
    this.canvas.style.height = this.height + "px";
    for (const canvas of [this.canvas, this.still]) {
      canvas.width = width * ratio;
      canvas.height = this.height * ratio;
    }
    const context = this.still.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "12px system-ui, sans-serif";
    this.panels.forEach((panel) => this.panel(context, panel));
  }

  /* What each panel shows: values by moment, what they are called, and the limits of its axis. */
  describe(drive) {
    const readings = Array.from({ length: drive.steps }, (_, step) => reading(drive, step));
    const moments = Array.from({ length: drive.steps + 1 }, (_, moment) => moment);
    const own = moments.map((moment) => drive.speed[moment * drive.slots + drive.own]), left = moments.map((moment) => countLeft(drive, moment));
    const milliseconds = readings.map((each) => each.milliseconds), period = 1000 * drive.dt;
    const severity = readings.map((each) => each.severity), ego = "own", most = (...values) => 1.08 * Math.max(...values);
    const near = { ticks: [0.1, 0.3, 1, 3, 10, 30], low: 0.05, high: 100, colour: ego, digits: 2, least: true };
    return [
      { label: "gap", unit: "m", values: drive.gap, dashed: drive.nearly[0], ...near },
      { label: "time to collision", unit: "s", values: drive.ttc, dashed: drive.nearly[1], ...near },
      { label: "ego speed", unit: "m/s", values: own, colour: ego, high: most(...own, 1), digits: 1 },
      { label: "predict and plan", unit: "ms", values: milliseconds, dashed: period, high: most(...milliseconds, period), digits: 1 },
      { label: "severity", unit: "m/s", values: severity, colour: "other", high: most(...severity, 1), digits: 1 },
      { label: "outside their sets", unit: "vehicles", values: left, colour: "ink", high: most(...left, 2), digits: 0 },
    ];
  }

  x(panel, moment) {
    return panel.left + (panel.right - panel.left) * moment / this.drive.steps;
  }

  /* The moment at a place [pixel] of the canvas. */
  moment(x) {
    const { left, right } = this.panels[x < this.width ? 0 : this.panels.length - 1];
    return Math.max(0, Math.min(this.drive.steps, (x - left) / (right - left) * this.drive.steps));
  }

  panel(context, panel) {
    const { left, right, top, tall, values, low, high, ticks, dashed } = panel, { steps, dt } = this.drive;
    const scale = low ? (value) => Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value) => value / high;
    panel.y = (value) => top + tall * (1 - scale(value));
    context.lineWidth = 1;
    context.fillStyle = Theme.colour("soft");
    context.strokeStyle = Theme.colour("grid");
    context.textAlign = "right";
    context.textBaseline = "middle";
    const round = (step) => Array.from({ length: Math.floor(high / step) + 1 }, (_, number) => number * step);
    const unit = 10 ** Math.floor(Math.log10(high / 2)), step = unit * (high / unit > 8 ? 5 : high / unit > 4 ? 2 : 1);
    for (const tick of ticks ?? round(step)) {
      context.beginPath();
      context.moveTo(left, panel.y(tick));
      context.lineTo(right, panel.y(tick));
      context.stroke();
      context.fillText(Number(tick.toPrecision(3)), left - 6, panel.y(tick));
    }
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    const apart = (right - left) / (steps * dt) > 24 ? 2 : 5;
    for (let second = 0; second <= steps * dt + 1e-6; second += apart) context.fillText(second + " s", this.x(panel, second / dt), top + tall + 13);
    context.strokeRect(left, top, right - left, tall);
    if (dashed) {
      context.setLineDash([5, 4]);
      context.strokeStyle = Theme.colour("soft");
      context.beginPath();
      context.moveTo(left, panel.y(dashed));
      context.lineTo(right, panel.y(dashed));
      context.stroke();
      context.setLineDash([]);
    }
    context.save();
    context.beginPath();
    context.rect(left, top, right - left, tall);
    context.clip();
    if (panel.colour) this.line(context, panel);
    else values.forEach((value, step) => {
      context.fillStyle = Theme.colour(slug(this.drive.statuses[this.drive.status[step]]));
      context.fillRect(this.x(panel, step) - 1.5, panel.y(value) - 1.5, 3, 3);
    });
    context.restore();
  }

  /* The values as a line, interrupted where there is none, with a dot at the least where it counts. */
  line(context, panel) {
    const { values } = panel;
    context.strokeStyle = context.fillStyle = Theme.colour(panel.colour);
    context.lineWidth = 1.8;
    context.beginPath();
    let drawn = false;
    values.forEach((value, moment) => {
      const known = !panel.least || value < NONE, place = [this.x(panel, moment), panel.y(value)];
      if (known) context[drawn ? "lineTo" : "moveTo"](...place);
      drawn = known;
    });
    context.stroke();
    const moment = values.indexOf(Math.min(...values));
    if (!panel.least || values[moment] >= NONE) return;
    context.fillStyle = Theme.colour("bad");
    context.beginPath();
    context.arc(this.x(panel, moment), panel.y(values[moment]), 4, 0, 7);
    context.fill();
  }

  /* The cursor at a moment with the values there; or at that under the pointer, with a pale cursor at the moment. */
  show(moment, pointed = null) {
    const context = this.context, ratio = devicePixelRatio || 1, told = Math.round(pointed ?? moment);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.still, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "12px system-ui, sans-serif";
    for (const panel of this.panels) {
      const { values, unit, left, right, top, tall } = panel, value = values[Math.min(told, values.length - 1)];
      const shown = panel.least && value >= NONE ? "–" : `${value.toFixed(panel.digits)} ${unit}`;
      context.strokeStyle = context.fillStyle = Theme.colour("ink");
      context.lineWidth = 1.2;
      for (const [at, alpha] of pointed === null ? [[moment, 1]] : [[moment, 0.35], [pointed, 1]]) {
        context.globalAlpha = alpha;
        context.beginPath();
        context.moveTo(this.x(panel, at), top);
        context.lineTo(this.x(panel, at), top + tall);
        context.stroke();
      }
      context.globalAlpha = 1;
      context.textAlign = "left";
      context.fillText(panel.label, left, top - 7);
      context.textAlign = "right";
      context.fillText(`${shown} at ${(told * this.drive.dt).toFixed(1)} s`, right, top - 7);
    }
  }
}
