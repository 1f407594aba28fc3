"use strict";
/* The player: which drive, which moment, and how fast. */
(() => {
  const element = (name) => document.getElementById(name);
  const player = element("player");
  if (!player) return;
  const road = new RoadView(element("road")), course = new CourseView(element("course"));
  const scrub = element("scrub"), play = element("play"), rate = element("rate"), chooser = element("trial");
  const drives = new Map();
  const ahead = element("ahead"), all = element("all"), deciding = element("deciding"), release = element("release"), ticks = element("ticks");
  let drive = null, moment = 0, playing = false, last = 0, shown = -1;
  let within = "deciding", slot = null;  // of what `RoadView.show` is told

  const show = () => {
    if (!drive || !player.clientWidth) return;
    road.show(drive, moment, { within, slot });
    course.show(moment);
    const step = Math.round(moment);
    scrub.value = Math.round(moment);
    element("clock").textContent = `${(moment * drive.dt).toFixed(1)} s of ${(drive.steps * drive.dt).toFixed(1)}`;
    if (step !== shown) readings(step);
    shown = step;
  };
  const readings = (step) => {
    const now = reading(drive, Math.min(step, drive.steps - 1));  // in the last moment, of the last plan
    const ended = drive.kind === "finished" ? (drive.near ? "finished, near miss" : "finished") : `${drive.kind} collision (at fault: ${drive.fault}; ${drive.cause})`;
    element("read-speed").textContent = `${drive.speed[step * drive.slots + drive.own].toFixed(1)} m/s`;
    element("read-acceleration").textContent = `${now.acceleration.toFixed(1).replace("-0.0", "0.0").replace("-", "−")} m/s²`;
    const least = (value, unit) => value < NONE ? `${value.toFixed(1)} ${unit}` : "–";
    element("read-gap").textContent = least(drive.gap[step], "m");
    element("read-ttc").textContent = least(drive.ttc[step], "s");
    element("read-severity").textContent = now.severity > 0 ? `${now.severity.toFixed(1)} m/s` : "–";
    const happened = drive.marks.filter(([at]) => at === step).map(([, , text]) => text);
    element("read-reason").textContent = happened.join("; ") || now.reason || element("status-" + slug(now.status)).title;
    element("worst").setAttribute("aria-pressed", step === drive.worst.moment);
    element("read-status").textContent = now.status;
    element("read-status").title = element("status-" + slug(now.status)).title;
    element("read-status").style.color = Theme.colour(slug(now.status));
    element("read-time").textContent = `${now.milliseconds.toFixed(1)} ms`;
    element("read-slack").textContent = now.slack.toFixed(3);
    element("read-paths").textContent = now.paths;
    element("read-active").textContent = now.active;
    element("read-left").textContent = countLeft(drive, step);
    element("read-end").textContent = step < drive.steps ? "" : ended;
    element("read-end").className = drive.kind !== "finished" ? "mark collision" : drive.near ? "mark near" : "";
  };
  const go = (to) => {
    moment = Math.max(0, Math.min(drive ? drive.steps : 0, to));
    show();
  };
  const look = (what) => {
    within = typeof what === "number" ? Math.max(0, Math.min(Number(ahead.max), what)) : what;
    ahead.value = typeof within === "number" ? within : 0;
    all.setAttribute("aria-pressed", within === "all");
    deciding.setAttribute("aria-pressed", within === "deciding");
    element("read-ahead").textContent = typeof within === "number" ? `+${within.toFixed(2)} s` : `0 … ${ahead.max} s`;
    show();
  };
  /* Shows the set of one vehicle alone; null: those of all. */
  const isolate = (which) => {
    slot = which === drive.own ? null : which;
    release.hidden = slot === null;
    release.textContent = `vehicle ${slot} alone ✕`;
    show();
  };
  const nextVehicle = () => {
    const next = road.inView().filter((number) => number !== drive.own).find((number) => number > (slot ?? -1));
    isolate(next ?? null);
  };
  /* To the next mark (or the previous one: by −1), of a kind if one is named, round the end. */
  const toMark = (by, kind = null) => {
    const places = drive.marks.filter((mark) => kind === null || mark[1] === kind).map(([at]) => at);
    if (!places.length) return;
    if (by < 0) places.reverse();
    setPlaying(false);
    go(places.find((at) => by * (at - Math.round(moment)) > 0) ?? places[0]);
  };
  const setPlaying = (on) => {
    if (!drive) return;
    playing = on;
    if (on && moment >= drive.steps) moment = 0;
    play.textContent = on ? "❚❚" : "▶";
    play.setAttribute("aria-label", on ? "Pause" : "Play");
    last = performance.now();
    if (on) requestAnimationFrame(tick);
  };
  const tick = (time) => {
    if (!playing) return;
    const now = Math.max(last, time);  // a frame may have begun before the click that started it
    moment += (now - last) / 1000 / drive.dt * Number(rate.value);
    last = now;
    if (moment >= drive.steps) {
      moment = drive.steps;
      setPlaying(false);
    } else requestAnimationFrame(tick);
    show();
  };
  const step = (by) => {
    setPlaying(false);
    go(Math.round(moment) + by);
  };
  const redraw = () => {
    if (!drive || !player.clientWidth) return;
    course.prepare(drive);
    showLegend(element("legend"), drive);
    shown = -1;
    show();
  };
  const load = async (trial) => {
    setPlaying(false);
    if (!drives.has(trial)) drives.set(trial, await readDrive(element("replay-data-" + trial).textContent));
    drive = drives.get(trial);
    chooser.value = trial;
    scrub.max = drive.steps;
    moment = drive.worst.moment;
    ahead.max = drive.planDt * (drive.points - 1);
    slot = null;
    release.hidden = true;
    element("worst").textContent = `${drive.worst.name} ${(moment * drive.dt).toFixed(1)} s`;
    element("read-worst").textContent = drive.worst.text;
    redraw();
    look("deciding");
    marks();
    player.dataset.loaded = trial;
  };
  /* A tick above the slider for every mark, and a button for every kind, which goes from one to the next. */
  const marks = () => {
    ticks.replaceChildren(...drive.marks.map(([step, kind]) => {
      const tick = document.createElement("i");
      tick.className = "mark-" + kind;
      tick.style.left = `${100 * step / drive.steps}%`;
      return tick;
    }));
    for (const button of element("marks").children) {
      const found = drive.marks.filter(([, kind]) => kind === button.dataset.kind);
      button.hidden = !found.length;
      button.lastElementChild.textContent = found.length > 1 ? `× ${found.length}` : found.length ? `${(found[0][0] * drive.dt).toFixed(1)} s` : "";
    }
  };
  /* The mark that is nearest to a pointer over the ticks. */
  const pointed = (event) => {
    const { left, width } = ticks.getBoundingClientRect(), at = (event.clientX - left) / width * drive.steps;
    return drive.marks.reduce((best, mark) => Math.abs(mark[0] - at) < Math.abs(best[0] - at) ? mark : best, drive.marks[0] ?? [0, "", ""]);
  };
  const fromAddress = () => {
    const named = /^#replay-(\d+)$/.exec(location.hash);
    if (!named || !element("replay-data-" + named[1])) return false;
    load(named[1]).then(() => {
      element("replay").scrollIntoView();
      player.focus({ preventScroll: true });
    });
    return true;
  };

  play.addEventListener("click", () => setPlaying(!playing));
  element("back").addEventListener("click", () => step(-1));
  element("forward").addEventListener("click", () => step(1));
  chooser.addEventListener("change", () => load(chooser.value));
  all.addEventListener("click", () => look("all"));
  deciding.addEventListener("click", () => look("deciding"));
  release.addEventListener("click", () => isolate(null));
  element("worst").addEventListener("click", () => step(drive.worst.moment - Math.round(moment)));
  for (const button of element("marks").children) button.addEventListener("click", () => toMark(1, button.dataset.kind));
  ticks.addEventListener("click", (event) => step(pointed(event)[0] - Math.round(moment)));
  ticks.addEventListener("pointermove", (event) => {
    const [at, , text] = pointed(event);
    if (text) Tip.show(`${(at * drive.dt).toFixed(1)} s: ${text}`, event);
  });
  ticks.addEventListener("pointerleave", () => Tip.hide());
  element("road").addEventListener("click", (event) => {
    const { left, top } = element("road").getBoundingClientRect(), found = road.slotAt(event.clientX - left, event.clientY - top);
    isolate(found === slot ? null : found);
  });
  ahead.addEventListener("input", () => look(Number(ahead.value)));
  scrub.addEventListener("input", () => {
    setPlaying(false);
    go(Number(scrub.value));
  });
  const seek = (event) => {
    if (!drive) return;
    const at = Math.round(course.moment(event));
    if (!event.buttons) return playing || course.show(moment, at);
    setPlaying(false);
    go(at);
  };
  element("course").addEventListener("pointerdown", seek);
  element("course").addEventListener("pointermove", seek);
  element("course").addEventListener("pointerleave", () => drive && course.show(moment));
  const faster = (by) => {
    rate.selectedIndex = Math.max(0, Math.min(rate.options.length - 1, rate.selectedIndex + by));
  };
  const keys = {
    " ": () => setPlaying(!playing), ArrowLeft: (event) => step(event.shiftKey ? -Math.round(1 / drive.dt) : -1),
    ArrowRight: (event) => step(event.shiftKey ? Math.round(1 / drive.dt) : 1), Home: () => step(-Infinity), End: () => step(Infinity),
    "+": () => faster(1), "-": () => faster(-1),
    ",": () => look((typeof within === "number" ? within : drive.planDt) - drive.planDt),
    ".": () => look((typeof within === "number" ? within : -drive.planDt) + drive.planDt),
    a: () => look("all"), d: () => look("deciding"), v: nextVehicle, Escape: () => isolate(null),
    n: () => toMark(1), p: () => toMark(-1), w: () => step(drive.worst.moment - Math.round(moment)),
  };
  /* Keys work where the player has the focus, and where nothing has it while the player is in view. */
  const meant = ({ key, target }) => {
    if (target === ahead && /^(Arrow|Home|End)/.test(key)) return false;
    if (player.contains(target)) return target.tagName !== "SELECT" && !(key === " " && target.tagName === "BUTTON");  // the browser presses it
    const { top, bottom } = player.getBoundingClientRect();
    return target === document.body && key !== "Home" && key !== "End" && top < innerHeight - 120 && bottom > 0.3 * innerHeight;
  };
  addEventListener("keydown", (event) => {
    if (!drive || !keys[event.key] || event.ctrlKey || event.metaKey || event.altKey || !meant(event)) return;
    event.preventDefault();
    keys[event.key](event);
  });
  let width = 0;
  new ResizeObserver(() => {
    if (width === player.clientWidth) return;
    width = player.clientWidth;
    redraw();
  }).observe(player);
  addEventListener("hashchange", fromAddress);
  Theme.onChange(redraw);
  if (!fromAddress()) load(chooser.value);
})();
