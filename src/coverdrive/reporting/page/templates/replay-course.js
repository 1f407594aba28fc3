"use strict";
/* The course of a drive over time, with a cursor shared by all panels: gap and time to collision on scales of ratios,
   speed, planning time, severity, and how many vehicles are outside their sets. */
const NONE = 99.5;  // [m], [s] from which a gap or a time to collision is none
class CourseView {
  constructor(element) {
    this.element = element;
  }

  /* Draws what does not move; `show` puts the cursor over it. */
  prepare(drive) {
    this.drive = drive;
    this.panels = this.describe(drive).map((course) => {
      const place = document.createElement("div"), panel = new Panel(place, this.panel(course), new Set());
      place.className = "panel";
      const [pale, cursor] = [0.35, 1].map((opacity) => make("path", { class: "cursor", opacity }));
      return { ...course, panel, pale, cursor, said: make("text", { y: 16, "text-anchor": "end" }) };
    });
    this.element.replaceChildren(...this.panels.map(({ panel }) => panel.place));
    for (const { panel, pale, cursor, said } of this.panels) {
      panel.draw();
      said.setAttribute("x", panel.at.right);
      panel.place.firstChild.append(pale, cursor, said);
    }
  }

  /* What each panel shows: values by moment, what they are called, and the limits of its axis. */
  describe(drive) {
    const readings = Array.from({ length: drive.steps }, (_, step) => reading(drive, step));
    const moments = Array.from({ length: drive.steps + 1 }, (_, moment) => moment);
    const own = moments.map((moment) => drive.speed[moment * drive.slots + drive.own]), left = moments.map((moment) => countLeft(drive, moment));
    const milliseconds = readings.map((each) => each.milliseconds), period = 1000 * drive.dt;
    const severity = readings.map((each) => each.severity), most = (...values) => 1.08 * Math.max(...values);
    const near = { ticks: [0.1, 0.3, 1, 3, 10, 30], low: 0.05, high: 100, colour: "own", digits: 2, least: true };
    return [
      { label: "gap", unit: "m", values: [...drive.gap], dashed: drive.nearly[0], ...near },
      { label: "time to collision", unit: "s", values: [...drive.ttc], dashed: drive.nearly[1], ...near },
      { label: "ego speed", unit: "m/s", values: own, colour: "own", high: most(...own, 1), digits: 1 },
      { label: "predict and plan", unit: "ms", values: milliseconds, dashed: period, high: most(...milliseconds, period), digits: 1 },
      { label: "severity", unit: "m/s", values: severity, colour: "other", high: most(...severity, 1), digits: 1 },
      { label: "outside their sets", unit: "vehicles", values: left, colour: "ink", high: most(...left, 2), digits: 0 },
    ];
  }

  /* The same as a figure has it: a line that is interrupted where there is none, with a dot at the least where it
     counts; of plans a dot each, in the colour of how it was found. */
  panel({ label, unit, values, dashed, low, high, ticks, colour, least }) {
    const { steps, dt, status, statuses } = this.drive, end = steps * dt, power = 10 ** Math.floor(Math.log10(high / 2));
    const step = power * (high / power > 8 ? 5 : high / power > 4 ? 2 : 1), apart = end > 30 ? 5 : 2;
    const round = (by, most) => Array.from({ length: Math.floor(most / by + 1e-9) + 1 }, (_, number) => number * by);
    const named = (places) => places.map((place) => [place, String(Number(place.toPrecision(3)))]);
    const known = values.map((value) => least && value >= NONE ? null : Math.max(value, low ?? 0));
    const x = values.map((_, moment) => moment * dt), marks = dashed ? [{ type: "Rule", axis: "y", at: dashed }] : [];
    const dots = (chosen, look) => marks.push({ type: "Points", x: chosen.map((at) => x[at]), y: chosen.map((at) => known[at]), ...look });
    if (colour) marks.push({ type: "Line", x, y: known, colour, width: 1.4 });
    else statuses.forEach((name, kind) => dots([...status.keys()].filter((at) => status[at] === kind), { colour: slug(name), marker: "s", size: 2 }));
    const best = values.indexOf(Math.min(...values));
    if (least && values[best] < NONE) dots([best], { colour: "bad", size: 6 });
    const y = { label: unit, low: low ?? 0, high, log: Boolean(low), ticks: named(ticks ?? round(step, high)) };
    return { title: label, x: { label: "time [s]", low: 0, high: end, log: false, ticks: named(round(apart, end)) }, y, marks };
  }

  /* The moment at which a pointer is. */
  moment({ target, clientX }) {
    const { panel } = this.panels.find((each) => each.panel.place.contains(target)) ?? this.panels[0], { left, right } = panel.at;
    return Math.max(0, Math.min(1, (clientX - panel.place.getBoundingClientRect().left - left) / (right - left))) * this.drive.steps;
  }

  /* The cursor at a moment with the values there; or at that under the pointer, with a pale cursor at the moment. */
  show(moment, pointed = null) {
    const told = Math.round(pointed ?? moment), { dt } = this.drive;
    for (const { panel, pale, cursor, said, values, unit, digits, least } of this.panels) {
      const { x, top, bottom } = panel.at, line = (at) => `M${x(at * dt)} ${top}V${bottom}`, value = values[Math.min(told, values.length - 1)];
      pale.setAttribute("d", pointed === null ? "" : line(moment));
      cursor.setAttribute("d", line(pointed ?? moment));
      said.textContent = `${least && value >= NONE ? "–" : `${value.toFixed(digits)} ${unit}`} at ${(told * dt).toFixed(1)} s`;
    }
  }
}
