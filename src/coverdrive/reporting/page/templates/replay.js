"use strict";
/* The player: which drive, which moment, and how fast. */
(() => {
  const element = (name) => document.getElementById(name);
  const player = element("player");
  if (!player) return;
  const road = new RoadView(element("road")), course = new CourseView(element("course"));
  const scrub = element("scrub"), play = element("play"), rate = element("rate"), chooser = element("trial");
  const drives = new Map();
  const ahead = element("ahead"), all = element("all");
  let drive = null, moment = 0, within = null, playing = false, last = 0, shown = -1;  // within the horizon [s]; null: all times

  const show = () => {
    if (!drive || !player.clientWidth) return;
    road.show(drive, moment, within);
    course.show(moment);
    const step = Math.floor(moment + 1e-9);
    scrub.value = Math.round(moment);
    element("clock").textContent = `${(moment * drive.dt).toFixed(1)} s of ${(drive.steps * drive.dt).toFixed(1)}`;
    if (step !== shown) readings(step);
    shown = step;
  };
  const readings = (step) => {
    const now = reading(drive, Math.min(step, drive.steps - 1));  // in the last moment, of the last plan
    const ended = drive.kind === "finished" ? (drive.near ? "finished, near miss" : "finished") : `${drive.kind} collision (at fault: ${drive.fault}; ${drive.cause})`;
    element("read-speed").textContent = `${drive.speed[step * drive.slots + drive.own].toFixed(1)} m/s`;
    element("read-acceleration").textContent = `${now.acceleration.toFixed(1).replace("-", "−")} m/s²`;
    const least = (value, unit) => value < 99.5 ? `${value.toFixed(1)} ${unit}` : "–";
    element("read-gap").textContent = least(drive.gap[step], "m");
    element("read-ttc").textContent = least(drive.ttc[step], "s");
    element("read-severity").textContent = now.severity > 0 ? `${now.severity.toFixed(1)} m/s` : "–";
    element("read-reason").textContent = now.reason || element("status-" + slug(now.status)).title;
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
  const look = (seconds) => {
    within = seconds === null ? null : Math.max(0, Math.min(Number(ahead.max), seconds));
    ahead.value = within ?? 0;
    all.setAttribute("aria-pressed", within === null);
    element("read-ahead").textContent = within === null ? `0 … ${ahead.max} s` : `+${within.toFixed(2)} s`;
    show();
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
    shown = -1;
    show();
  };
  const load = async (trial) => {
    setPlaying(false);
    if (!drives.has(trial)) drives.set(trial, await readDrive(element("replay-data-" + trial).textContent));
    drive = drives.get(trial);
    chooser.value = trial;
    scrub.max = drive.steps;
    moment = 0;
    ahead.max = drive.planDt * (drive.points - 1);
    within = null;
    redraw();
    look(null);
    marks();
    player.dataset.loaded = trial;
  };
  const marks = () => element("events").replaceChildren(...drive.events.map(([step, colour, text]) => {
    const mark = document.createElement("button");
    mark.type = "button";
    mark.tabIndex = -1;
    mark.title = `${(step * drive.dt).toFixed(1)} s: ${text}`;
    mark.style.left = `${100 * step / drive.steps}%`;
    mark.style.background = `var(--${slug(colour)})`;
    mark.addEventListener("click", () => {
      setPlaying(false);
      go(step);
    });
    return mark;
  }));
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
  all.addEventListener("click", () => look(null));
  ahead.addEventListener("input", () => look(Number(ahead.value)));
  scrub.addEventListener("input", () => {
    setPlaying(false);
    go(Number(scrub.value));
  });
  const seek = (event) => {
    if (!drive || !event.buttons) return;
    setPlaying(false);
    go(Math.round(course.moment(event.clientX - element("course").getBoundingClientRect().left)));
  };
  element("course").addEventListener("pointerdown", seek);
  element("course").addEventListener("pointermove", seek);
  const faster = (by) => {
    rate.selectedIndex = Math.max(0, Math.min(rate.options.length - 1, rate.selectedIndex + by));
  };
  const keys = {
    " ": () => setPlaying(!playing), ArrowLeft: (event) => step(event.shiftKey ? -Math.round(1 / drive.dt) : -1),
    ArrowRight: (event) => step(event.shiftKey ? Math.round(1 / drive.dt) : 1), Home: () => step(-Infinity), End: () => step(Infinity),
    "+": () => faster(1), "-": () => faster(-1),
    ",": () => look((within ?? drive.planDt) - drive.planDt), ".": () => look((within ?? -drive.planDt) + drive.planDt), a: () => look(null),
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
