"use strict";
/* The course of a drive over time, with a cursor: speed, gap, time to collision, planning time, severity, and how many
   vehicles are outside their sets. */
const HEIGHT = 412;
class CourseView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.still = document.createElement("canvas");
  }

  /* Draws what does not move; `show` puts the cursor over it. */
  prepare(drive) {
    const width = this.canvas.clientWidth, ratio = devicePixelRatio || 1, narrow = width < 560;
    this.drive = drive;
    this.left = 52;
    this.right = width - 20;
    this.canvas.style.height = HEIGHT + "px";
    for (const canvas of [this.canvas, this.still]) {
      canvas.width = width * ratio;
      canvas.height = HEIGHT * ratio;
    }
    const context = this.still.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "11px system-ui, sans-serif";
    const readings = Array.from({ length: drive.steps }, (_, step) => reading(drive, step));
    const own = Array.from({ length: drive.steps + 1 }, (_, moment) => drive.speed[moment * drive.slots + drive.own]);
    const ego = Theme.colour("own"), upTo = (values, most) => Array.from(values, (value) => Math.min(value, most));
    const milliseconds = readings.map((each) => each.milliseconds), period = 1000 * drive.dt;
    this.panel(context, "ego speed [m/s]", 18, 44, own, ego, Math.max(...own, 1));
    this.panel(context, `gap [m], up to 10${narrow ? "" : "; dashed: near miss"}`, 86, 36, upTo(drive.gap, 10), ego, 10, drive.nearly[0]);
    this.panel(context, `time to collision [s], up to 10${narrow ? "" : "; dashed: near miss"}`, 146, 36, upTo(drive.ttc, 10), ego, 10, drive.nearly[1]);
    this.panel(context, narrow ? "predict and plan [ms], dashed: real time" : "prediction and planning [ms], dots by how the plan was found, dashed: real time", 206, 44, milliseconds, null, Math.max(...milliseconds, 1.1 * period), period);
    this.panel(context, "severity [m/s]", 274, 36, readings.map((each) => each.severity), Theme.colour("other"), Math.max(...drive.severity, 1));
    const left = Array.from({ length: drive.steps + 1 }, (_, moment) => countLeft(drive, moment));
    this.panel(context, "vehicles that have left their predicted set", 334, 34, left, Theme.colour("ink"), Math.max(...left, 1));
    context.fillStyle = Theme.colour("soft");
    context.textAlign = "center";
    for (let second = 0; second <= drive.steps * drive.dt + 1e-6; second += narrow ? 5 : 2) context.fillText(second + " s", this.x(second / drive.dt), HEIGHT - 8);
  }

  x(moment) {
    return this.left + (this.right - this.left) * moment / this.drive.steps;
  }

  moment(x) {
    return Math.max(0, Math.min(this.drive.steps, (x - this.left) / (this.right - this.left) * this.drive.steps));
  }

  panel(context, label, top, height, values, colour, largest, dashed) {
    const y = (value) => top + height * (1 - value / (1.08 * largest));
    context.strokeStyle = Theme.colour("grid");
    context.lineWidth = 1;
    context.strokeRect(this.left, top, this.right - this.left, height);
    context.fillStyle = Theme.colour("soft");
    context.textAlign = "left";
    context.fillText(label, this.left, top - 5);
    context.textAlign = "right";
    context.fillText("0", this.left - 6, top + height);
    context.fillText(largest.toFixed(largest < 1 ? 2 : largest < 10 && largest % 1 ? 1 : 0), this.left - 6, y(largest) + 8);
    if (dashed) {
      context.setLineDash([5, 4]);
      context.strokeStyle = Theme.colour("soft");
      context.beginPath();
      context.moveTo(this.left, y(dashed));
      context.lineTo(this.right, y(dashed));
      context.stroke();
      context.setLineDash([]);
    }
    if (colour) {
      context.strokeStyle = colour;
      context.lineWidth = 1.8;
      context.beginPath();
      values.forEach((value, moment) => context.lineTo(this.x(moment), y(value)));
      context.stroke();
      return;
    }
    values.forEach((value, step) => {
      context.fillStyle = Theme.colour(slug(this.drive.statuses[this.drive.status[step]]));
      context.fillRect(this.x(step) - 1.5, y(value) - 1.5, 3, 3);
    });
  }

  show(moment) {
    const context = this.context, ratio = devicePixelRatio || 1;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.still, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.strokeStyle = Theme.colour("ink");
    context.lineWidth = 1.2;
    context.beginPath();
    context.moveTo(this.x(moment), 12);
    context.lineTo(this.x(moment), HEIGHT - 28);
    context.stroke();
  }
}
