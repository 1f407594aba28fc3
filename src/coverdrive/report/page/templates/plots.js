"use strict";
/* Light or dark, and the Plotly figures, which take their background from the style sheet. */
const Theme = (() => {
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  let chosen = null;
  const set = (theme) => {
    root.dataset.theme = theme;
    listeners.forEach((listener) => listener());
  };
  const update = () => set(chosen || (system.matches ? "dark" : "light"));
  system.addEventListener("change", update);
  document.getElementById("theme").addEventListener("click", () => {
    chosen = root.dataset.theme === "dark" ? "light" : "dark";
    update();
  });
  addEventListener("beforeprint", () => set("light"));
  addEventListener("afterprint", update);
  update();
  return {
    colour: (name) => getComputedStyle(root).getPropertyValue("--" + name).trim(),
    onChange: (listener) => listeners.push(listener),
  };
})();

(() => {
  const template = () => {
    const ink = Theme.colour("ink"), axis = { gridcolor: Theme.colour("grid"), linecolor: Theme.colour("line"), zerolinecolor: Theme.colour("line"), tickcolor: Theme.colour("line"), title: { font: { color: Theme.colour("soft"), size: 13 } }, ticks: "outside", showline: true };
    return { layout: {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", xaxis: axis, yaxis: axis,
      font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: ink },
      hoverlabel: { bgcolor: Theme.colour("raised"), bordercolor: Theme.colour("line"), font: { color: ink } },
    } };
  };
  const figures = [...document.querySelectorAll("script[data-plot]")].map((script) => [document.getElementById(script.dataset.plot), JSON.parse(script.textContent)]);
  const config = { responsive: true, displaylogo: false, displayModeBar: false };
  const draw = (place, figure) => Plotly.react(place, figure.data, { ...figure.layout, template: template() }, config);
  figures.forEach(([place, figure]) => draw(place, figure));
  Theme.onChange(() => figures.forEach(([place, figure]) => draw(place, figure)));
})();
