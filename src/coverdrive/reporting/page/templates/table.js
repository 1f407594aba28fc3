"use strict";
/* The table of trials: sorted by a click on a column, filtered by a click on a kind. */
(() => {
  const table = document.getElementById("trials");
  if (!table) return;
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  const value = (row, column) => {
    const text = row.cells[column].dataset.value;
    return text === "inf" ? Infinity : text === "nan" ? NaN : isNaN(text) ? text : Number(text);
  };
  heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => {
    const before = head.getAttribute("aria-sort");
    const order = { ascending: "descending", descending: "ascending" }[before] || head.dataset.first || "ascending";
    const sign = order === "ascending" ? 1 : -1;
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", order);
    const rows = [...body.rows].sort((one, other) => {
      const a = value(one, column), b = value(other, column);
      return Number.isNaN(a) - Number.isNaN(b) || (a < b ? -sign : a > b ? sign : 0);
    });
    body.append(...rows);
  }));
  const buttons = [...document.querySelectorAll(".filters button")];
  buttons.forEach((button) => button.addEventListener("click", () => {
    buttons.forEach((other) => other.setAttribute("aria-pressed", String(other === button)));
    const show = button.dataset.show;
    for (const row of body.rows) {
      row.hidden = !(show === "all" || row.dataset.mark === show || (show === "replay" && row.dataset.replay === "1"));
    }
  }));
})();
