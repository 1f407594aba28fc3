"use strict";
/* What stands on the road, each drawn by the `RoadView` that draws the road, of a made-up vehicle and plan of two steps. */
const SAMPLE = {
  own: 0, sizes: [[4.4, 1.2]], points: 3, planPoints: 3, planDt: 1, first: [0, 1], total: 1, vehicle: [1], active: [2],
  paths: [-2.6, 0, 0, 0, 2.6, 0], boxes: [1.6, 1.1, 1.6, 1.1, 1.6, 1.1], met: [0], metAt: [1],
  plan: [-3.6, -1, 0, 0, -1, 0, 3.6, -1, 0], held: [-3.6, -1, 0, -0.6, -0.7, 0, 1.8, 0.3, 0],
};
const REST = { within: "deciding", slot: null }, BINDING = new Map([[1, 1]]);
const car = (long, wide) => ({ lon: 0, lat: 0, heading: 0, speed: 25, size: [long, wide] });

/* What it is called, how it is drawn, and whether it is in a drive, if not in any. */
const LEGEND = [
  ["ego", (view) => view.body(car(5, 2), true, false)],
  ["other vehicle; number: speed, m/s", (view) => view.body(car(5, 2), false, false)],
  ["plan; dashed: its fail-safe branch", (view) => view.plan({ ...SAMPLE, held: [-3.6, -1, 0, 0, 0.6, 0, 3.6, 1, 0] }, 0, REST, new Map())],
  ["set that binds the plan, or comes nearest", (view) => { view.sets(SAMPLE, 0, REST, BINDING); view.members(SAMPLE, 0, REST); }],
  ["ego at the time of that set", (view) => view.plan({ ...SAMPLE, held: [-3.6, -1, 0, 0, -1, 0, 3.6, -1, 0] }, 0, REST, BINDING)],
  ["other sets at that time", (view) => view.sets(SAMPLE, 0, REST, new Map())],
  ["hue of a set: now … end of horizon", (view) => view.sets(SAMPLE, 0, { within: "all", slot: null }, new Map())],
  ["plan meets a set", (view) => view.met(SAMPLE, 0, REST), (drive) => drive.met.some((path) => path >= 0)],
  ["has left its set", (view) => { view.frame(car(3, 1.5), "ink", 3); view.body(car(3, 1.5), false, false); }, (drive) => drive.left.some(Boolean)],
  ["whom the text above is about", (view) => { view.frame(car(3, 1.2), "bad", 7); view.body(car(3, 1.2), false, false); }, (drive) => drive.worst.slot >= 0],
  ["touches the ego", (view) => view.body(car(3, 1.5), false, true), (drive) => drive.partner !== null],
];

function showLegend(list, drive) {
  list.replaceChildren(...LEGEND.filter(([, , there]) => !there || there(drive)).map(([label]) => {
    const item = document.createElement("li");
    item.append(document.createElement("canvas"), label);
    return item;
  }));
  for (const { firstChild: canvas, lastChild: label } of list.children) {
    const view = new RoadView(canvas), { clientWidth: width, clientHeight: height } = canvas, ratio = devicePixelRatio || 1;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    view.context.scale(ratio, ratio);
    [view.along, view.across] = [width / 8.8, height / 3.4];
    view.place = (lon, lat) => [width / 2 + lon * view.along, height / 2 - lat * view.across];
    LEGEND.find(([name]) => name === label.data)[1](view);
  }
}
