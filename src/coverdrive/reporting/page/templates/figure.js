"use strict";
/* Draws the figures that Python specifies (`coverdrive.reporting.plotting.figure`): one SVG for each panel, when it comes into view. */
const POINT = 4 / 3;  // [pixel] of a typographic point
const make = (tag, attributes = {}, text = null) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== null) element.textContent = text;
  return element;
};
/* Colours of the printed figures have names in the style sheet where a dark page needs others. */
const paint = (colour) => colour.startsWith("#") ? `var(--c${colour.slice(1).toLowerCase()}, ${colour})` : `var(--${colour})`;
const row = (value, length) => Array.isArray(value) ? value : Array(length).fill(value);

const polygon = (corners, turn, inner = 1) => (x, y, r) => {
  const points = Array.from({ length: inner === 1 ? corners : 2 * corners }, (_, k, count = inner === 1 ? corners : 2 * corners) => {
    const angle = turn + 2 * Math.PI * k / count, reach = r * (k % 2 ? inner : 1) * 1.25;
    return `${(x + reach * Math.cos(angle)).toFixed(1)} ${(y + reach * Math.sin(angle)).toFixed(1)}`;
  });
  return `M${points.join("L")}Z`;
};
const circle = (x, y, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
const UP = -Math.PI / 2;
const MARKERS = {
  o: circle, ".": (x, y, r) => circle(x, y, r / 2), s: polygon(4, Math.PI / 4), D: polygon(4, 0), d: polygon(2, UP, 0.6), "^": polygon(3, UP),
  v: polygon(3, -UP), ">": polygon(3, 0), p: polygon(5, UP), H: polygon(6, 0), "*": polygon(5, UP, 0.45), P: polygon(4, UP, 0.45), X: polygon(4, Math.PI / 4, 0.45),
  x: (x, y, r) => `M${x - r} ${y - r}l${2 * r} ${2 * r}m0 ${-2 * r}l${-2 * r} ${2 * r}`, "|": (x, y, r) => `M${x} ${y - r}v${2 * r}`,
};

/* What a mark looks like, as a path; `at` turns values into pixels, `target` takes what can be pointed at. */
const DRAW = {
  Line: (mark, at, target) => {
    const pieces = [[]];
    mark.x.forEach((x, k) => {
      if (x === null || mark.y[k] === null) return pieces.push([]);
      const piece = pieces[pieces.length - 1], point = [at.x(x), at.y(mark.y[k])];
      if (mark.step && piece.length) piece.push([point[0], piece[piece.length - 1][1]]);
      piece.push(point);
    });
    if (mark.hover) pieces.forEach((line) => target({ line, text: mark.hover }));
    return pieces.filter((piece) => piece.length).map((piece) => `M${piece.map((point) => point.map((value) => value.toFixed(1)).join(" ")).join("L")}`).join("");
  },
  Points: (mark, at, target) => mark.x.map((value, k) => {
    const x = at.x(value), y = at.y(mark.y[k]), r = (mark.size ?? 5) * POINT / 2;
    if (mark.hover) target({ point: [x, y], text: mark.hover[k] });
    const bar = !mark.low ? "" : mark.along === "x" ? `M${at.x(mark.low[k])} ${y}H${at.x(mark.high[k])}` : `M${x} ${at.y(mark.low[k])}V${at.y(mark.high[k])}`;
    return bar + MARKERS[mark.marker ?? "o"](x, y, r);
  }).join(""),
  Bars: (mark, at, target) => {
    const widths = row(mark.width ?? 0.8, mark.x.length), base = mark.base ?? 0;
    return mark.x.map((x, k) => {
      const [left, right] = [at.x(x - widths[k] / 2), at.x(x + widths[k] / 2)], [low, high] = [at.y(base), at.y(base + mark.height[k])];
      if (mark.hover) target({ box: [left, Math.min(high, low - 6), right, low], text: mark.hover[k] });
      return `M${left.toFixed(1)} ${low.toFixed(1)}V${high.toFixed(1)}H${right.toFixed(1)}V${low.toFixed(1)}Z`;
    }).join("");
  },
  Band: (mark, at) => {
    const edge = (values) => mark.x.map((x, k) => `${at.x(x)} ${at.y(values[k])}`);
    return `M${[...edge(mark.low), ...edge(mark.high).reverse()].join("L")}Z`;
  },
  Shapes: (mark, at) => mark.outlines.map((points) => `M${points.map(([x, y]) => `${at.x(x).toFixed(1)} ${at.y(y).toFixed(1)}`).join("L")}Z`).join(""),
  Rule: (mark, at) => mark.axis === "y" ? `M${at.left} ${at.y(mark.at)}H${at.right}` : `M${at.x(mark.at)} ${at.top}V${at.bottom}`,
};
const LINES = new Set(["Line", "Rule"]);

function look(mark) {
  const colour = paint(mark.colour ?? (mark.type === "Rule" ? "#8A8A8A" : "#0072B2"));
  const dash = (mark.dashed ?? mark.type === "Rule") ? "stroke-dasharray: 6 4;" : "";
  const width = `stroke-width: ${((mark.width && !Array.isArray(mark.width) && mark.type !== "Bars" ? mark.width : mark.type === "Shapes" ? 0.8 : 1.2) * POINT).toFixed(2)};`;
  if (LINES.has(mark.type)) return `fill: none; stroke: ${colour}; ${width} ${dash} opacity: ${mark.opacity ?? 1}`;
  if (mark.type === "Shapes") return `fill: ${mark.filled === false ? "none" : colour}; fill-opacity: .16; stroke: ${colour}; ${width} ${dash}`;
  if (mark.type === "Points") return `fill: ${mark.hollow ? "var(--paper)" : colour}; stroke: ${colour}; stroke-width: ${mark.marker === "|" ? 2.4 : 1.3}; opacity: ${mark.opacity ?? 1}`;
  return `fill: ${colour}; opacity: ${mark.opacity ?? 1}`;
}

class Panel {
  constructor(place, data, hidden) {
    Object.assign(this, { place, data, hidden, targets: [] });
    place.addEventListener("pointermove", (event) => this.point(event));
    place.addEventListener("pointerleave", () => Tip.hide());
  }

  /* From values to pixels. */
  frame() {
    const { x, y, title } = this.data, width = this.place.clientWidth, height = this.place.clientHeight;
    const longest = Math.max(...y.ticks.map(([, text]) => text.length));
    const at = { width, height, left: 34 + 6.6 * longest, right: width - 16, top: title ? 28 : 10, bottom: height - 44 };
    const scale = (axis, from, to) => {
      const inner = axis.log ? Math.log : (value) => value, low = inner(axis.low), high = inner(axis.high);
      return (value) => from + (to - from) * (inner(value) - low) / (high - low);
    };
    return { ...at, x: scale(x, at.left, at.right), y: scale(y, at.bottom, at.top) };
  }

  draw() {
    if (!this.place.clientWidth) return;
    const at = this.at = this.frame(), svg = make("svg", { width: at.width, height: at.height, "aria-hidden": true });
    this.targets = [];
    this.axes(svg, at);
    const clip = make("clipPath", { id: `clip-${Panel.count = (Panel.count ?? 0) + 1}` });
    clip.append(make("rect", { x: at.left, y: at.top, width: Math.max(0, at.right - at.left), height: at.bottom - at.top }));
    svg.append(clip);
    this.data.marks.forEach((mark, number) => {
      if (this.hidden.has(mark.name)) return;
      const group = make("g", { "data-mark": number });
      if (mark.type === "Texts") this.words(group, mark, at);
      else group.append(make("path", { d: DRAW[mark.type](mark, at, (target) => this.targets.push(target)), style: look(mark), ...(mark.type === "Points" ? {} : { "clip-path": `url(#${clip.id})` }) }));
      svg.append(group);
    });
    this.place.replaceChildren(svg);
  }

  axes(svg, at) {
    const { x, y, title } = this.data;
    let free = -Infinity;
    for (const [value, text] of x.ticks) {
      const place = at.x(value), half = 3.4 * text.length;
      svg.append(make("path", { class: "grid", d: `M${place} ${at.top}V${at.bottom}` }));
      if (place - half < free) continue;
      free = place + half + 4;
      svg.append(make("text", { class: "tick", x: place, y: at.bottom + 17, "text-anchor": "middle" }, text));
    }
    for (const [value, text] of y.ticks) {
      const place = at.y(value);
      svg.append(make("path", { class: "grid", d: `M${at.left} ${place}H${at.right}` }));
      svg.append(make("text", { class: "tick", x: at.left - 6, y: place + 4, "text-anchor": "end" }, text));
    }
    svg.append(make("path", { class: "axis", d: `M${at.left} ${at.top}V${at.bottom}H${at.right}` }));
    const middle = (at.top + at.bottom) / 2;
    svg.append(make("text", { class: "label", x: (at.left + at.right) / 2, y: at.height - 8, "text-anchor": "middle" }, x.label));
    svg.append(make("text", { class: "label", transform: `translate(14 ${middle}) rotate(-90)`, "text-anchor": "middle" }, y.label));
    if (title) svg.append(make("text", { class: "title", x: at.left, y: 16 }, title));
  }

  words(group, mark, at) {
    const anchors = row(mark.anchor ?? "start", mark.text.length), beside = { start: 4, middle: 0, end: -4 };
    mark.text.forEach((text, k) => group.append(make("text", {
      class: "word", x: at.x(mark.x[k]) + beside[anchors[k]], y: at.y(mark.y[k]) + (mark.above ? -mark.above * POINT : 4),
      "text-anchor": anchors[k], style: `fill: ${paint(mark.colour ?? "#0072B2")}`,
    }, text)));
  }

  /* Says what is under the pointer: a point before a bar, a bar before a line. */
  point(event) {
    const bounds = this.place.getBoundingClientRect(), x = event.clientX - bounds.left, y = event.clientY - bounds.top;
    const far = ({ point, line, box }) => {
      if (point) return Math.hypot(point[0] - x, point[1] - y);
      if (box) return x >= box[0] && x <= box[2] && y >= box[1] && y <= box[3] ? 9 : Infinity;
      return 4 + Math.min(...line.slice(1).map((end, k) => distance(x, y, line[k], end)));
    };
    const [nearest, target] = this.targets.map((each) => [far(each), each]).reduce((best, each) => each[0] < best[0] ? each : best, [16, null]);
    if (target) Tip.show(target.text, event);
    else Tip.hide();
    return nearest;
  }
}

function distance(x, y, [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, along = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(ax + along * dx - x, ay + along * dy - y);
}

const Tip = (() => {
  const tip = document.createElement("div");
  tip.className = "tip";
  document.body.append(tip);
  return {
    show: (text, event) => {
      tip.textContent = text;
      tip.style.display = "block";
      const left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8);
      tip.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, event.clientY - tip.offsetHeight - 12)}px)`;
    },
    hide: () => { tip.style.display = "none"; },
  };
})();

class FigureView {
  constructor(element) {
    this.data = JSON.parse(element.querySelector("script").textContent);
    this.element = element;
    this.hidden = new Set();
    this.panels = this.data.rows.flatMap(({ height, panels }) => {
      const line = document.createElement("div");
      line.className = "row";
      element.querySelector(".panels").append(line);
      return panels.map((panel) => {
        const place = document.createElement("div");
        place.className = "panel";
        place.style.height = `${Math.max(200, Math.round(height * 112))}px`;
        line.append(place);
        return new Panel(place, panel, this.hidden);
      });
    });
    this.key(element.querySelector(".key"));
  }

  /* The legend: a click on an entry hides it and shows it again. */
  key(place) {
    const named = new Map();
    this.panels.forEach((panel) => panel.data.marks.forEach((mark) => mark.name && !named.has(mark.name) && named.set(mark.name, mark)));
    for (const [name, mark] of named) {
      const button = document.createElement("button"), icon = make("svg", { width: 22, height: 14, "aria-hidden": true });
      const line = LINES.has(mark.type), marker = MARKERS[mark.marker ?? "o"];
      icon.append(make("path", { style: look(mark), d: line ? "M1 7H21" : mark.type === "Points" ? marker(11, 7, 4.5) : "M3 2H19V12H3Z" }));
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      button.append(icon, name);
      button.addEventListener("click", () => {
        if (!this.hidden.delete(name)) this.hidden.add(name);
        button.setAttribute("aria-pressed", String(!this.hidden.has(name)));
        this.draw();
      });
      place.append(button);
    }
  }

  draw() {
    this.panels.forEach((panel) => panel.draw());
    this.width = this.element.clientWidth;
  }
}

const figures = new Map([...document.querySelectorAll("figure.result")].map((element) => [element.id.replace("figure-", ""), new FigureView(element)]));
(() => {
  const near = new IntersectionObserver((entries) => entries.forEach((entry) => {
    const view = entry.isIntersecting && figures.get(entry.target.id.replace("figure-", ""));
    if (view && view.width === undefined) view.draw();
  }), { rootMargin: "800px" });
  const resized = new ResizeObserver((entries) => entries.forEach(({ target }) => {
    const view = figures.get(target.id.replace("figure-", ""));
    if (view.width !== undefined && view.width !== target.clientWidth) view.draw();
  }));
  figures.forEach((view) => {
    near.observe(view.element);
    resized.observe(view.element);
  });
  for (const event of ["beforeprint", "afterprint"]) addEventListener(event, () => figures.forEach((view) => view.draw()));
})();
