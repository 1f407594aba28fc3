"use strict";
/* Light or dark: as the system has it, until a click decides; paper is always light. */
const Theme = (() => {
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  let chosen = null, unfolded = [];
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
    unfolded = [...document.querySelectorAll("details:not([open]):has(figure)")];  // paper shows all figures
    for (const each of unfolded) each.open = true;
    set("light");
  });
  addEventListener("afterprint", () => {
    root.classList.remove("printing");
    for (const each of unfolded) each.open = false;
    update();
  });
  update();
  return {
    colour: (name) => getComputedStyle(root).getPropertyValue("--" + name).trim(),
    onChange: (listener) => listeners.push(listener),
  };
})();
