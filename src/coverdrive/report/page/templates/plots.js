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
  addEventListener("beforeprint", () => {
    root.classList.add("printing");
    set("light");
  });
  addEventListener("afterprint", () => {
    root.classList.remove("printing");
    update();
  });
  update();
  return {
    colour: (name) => getComputedStyle(root).getPropertyValue("--" + name).trim(),
    onChange: (listener) => listeners.push(listener),
  };
})();

(() => {
  const template = () => {
    const ink = Theme.colour("ink");
    const axis = { gridcolor: Theme.colour("grid"), linecolor: Theme.colour("line"), zerolinecolor: Theme.colour("line"), tickcolor: Theme.colour("line"), title: { font: { color: Theme.colour("soft"), size: 13 } }, ticks: "outside", showline: true };
    return { layout: {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", xaxis: axis, yaxis: axis,
      font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: ink },
      hoverlabel: { bgcolor: Theme.colour("raised"), bordercolor: Theme.colour("line"), font: { color: ink } },
    } };
  };
  /* The darker of Okabe and Ito's colours are lightened on a dark page, and what is as light as the page is dark. */
  const lighter = { "#0072B2": "#3F9FE0", "#D55E00": "#E57A2E", "#009E73": "#2FC29A", "rgba(0,114,178,": "rgba(63,159,224,", "rgba(213,94,0,": "rgba(229,122,46,", "#FFFFFF": "#14171B" };
  const shown = (text) => document.documentElement.dataset.theme !== "dark" ? text
    : Object.entries(lighter).reduce((lightened, [from, to]) => lightened.replaceAll(from, to), text);
  const figures = [...document.querySelectorAll("script[data-plot]")].map((script) => [document.getElementById(script.dataset.plot), script.textContent]);
  const config = { responsive: true, displaylogo: false, displayModeBar: false };
  const draw = () => figures.forEach(([place, text]) => {
    const figure = JSON.parse(shown(text));
    const width = document.documentElement.classList.contains("printing") ? { width: place.clientWidth } : {};
    if (place.clientWidth < 620) figure.data.forEach((trace) => { if (trace.meta === "wide text") trace.mode = "markers"; });
    Plotly.react(place, figure.data, { ...figure.layout, ...width, template: template() }, config);
  });
  draw();
  Theme.onChange(draw);
})();
