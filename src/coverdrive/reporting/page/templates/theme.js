"use strict";
/* Light or dark: as the system has it, until a click decides; paper is always light. */
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
