"use strict";
// What is shown: data.labels and data.times have an entry a frame, data.sets a list of addresses each.
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const sets = data.sets, count = data.labels.length;
const canvas = $("picture"), paint = canvas.getContext("2d"), stage = $("stage");
const AHEAD = 8;
let at = 0, playing = false, wipe = 0.5, drawn = -1;
let due = 0, lately = [];
let mode = sets.length > 1 ? "side" : "a";

// Images are kept once asked for; the browser lets go of what it decoded where memory is short.
const images = sets.map(() => []);
function image(set, k) {
  if (!images[set][k]) {
    const it = new Image();
    it.onerror = () => { it.isBroken = true; };
    it.src = sets[set].pictures[k];
    images[set][k] = it;
  }
  return images[set][k];
}
const needed = () => (mode === "a" ? [0] : mode === "b" ? [1] : sets.map((_, set) => set));
const isReady = (k) => needed().every((set) => image(set, k).complete && !image(set, k).isBroken);

function draw(k) {
  const [width, height] = sets[0].size;
  const columns = mode === "side" ? 2 * width : width;
  if (canvas.width !== columns || canvas.height !== height) {
    canvas.width = columns;
    canvas.height = height;
    stage.style.aspectRatio = `${columns} / ${height}`;
  }
  paint.globalCompositeOperation = "source-over";
  const put = (set, left) => paint.drawImage(image(set, k), left, 0, width, height);
  put(mode === "b" ? 1 : 0, 0);
  if (mode === "side") put(1, width);
  if (mode === "wipe") {
    const edge = Math.round(wipe * width);
    paint.save();
    paint.beginPath();
    paint.rect(edge, 0, width - edge, height);
    paint.clip();
    put(1, 0);
    paint.restore();
    paint.fillStyle = "#fff";
    paint.fillRect(edge - 1, 0, 2, height);
  }
  if (mode === "difference") {
    paint.globalCompositeOperation = "difference";
    put(1, 0);
    paint.globalCompositeOperation = "lighter";
    for (let gain = 1; gain < Number($("gain").value); gain *= 2) paint.drawImage(canvas, 0, 0);
  }
  drawn = k;
  document.body.dataset.shown = data.labels[k];
}

async function refresh() {
  const k = at;
  const broken = [];
  await Promise.all(needed().map(async (set) => {
    try { await image(set, k).decode(); } catch { broken.push(sets[set].name); }
  }));
  if (k !== at) return;
  $("fault").textContent = broken.length ? `the picture ${data.labels[k]} of ${broken.join(", ")} cannot be loaded` : "";
  if (!broken.length) draw(k);
  for (let next = 1; next <= AHEAD; next++) for (const set of needed()) image(set, (k + next) % count);
}

function show(k, fromPlay) {
  at = Math.min(Math.max(k, 0), count - 1);
  $("scrub").value = at;
  $("scrub").setAttribute("aria-valuetext", data.labels[at]);
  const time = data.times[at];
  const rate = playing && lately.length > 3 ? ((lately.length - 1) * 1000) / (lately[lately.length - 1] - lately[0]) : 0;
  $("told").textContent =
    `${/^\d+$/.test(data.labels[at]) ? "frame " : ""}${data.labels[at]}  (${at + 1} of ${count})` + (time === null ? "" : `  ${time.toFixed(3)} s`) + (rate ? `  ${rate.toFixed(1)} frames/s` : "");
  for (const figure of document.querySelectorAll("#curves figure")) {
    const [[first, last], [left, right]] = JSON.parse(figure.dataset.across);
    const cursor = figure.querySelector("i");
    const part = time === null ? -1 : (time - first) / (last - first);
    cursor.hidden = !(part >= -1e-9 && part <= 1 + 1e-9);
    cursor.style.left = `${100 * (left + part * (right - left))}%`;
  }
  try { history.replaceState(null, "", `#${encodeURIComponent(data.labels[at])}`); } catch { /* where the browser forbids it */ }
  if (fromPlay) draw(at); else refresh();
}

function press(on) {
  playing = on;
  lately = [];
  $("play").textContent = on ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", on);
  if (on) {
    if (at === count - 1) show(0);
    due = performance.now();
    requestAnimationFrame(tick);
  }
}

// Every frame is shown: where pictures come too slowly, the rate falls, and the rate that is had is told.
function tick(now) {
  if (!playing) return;
  requestAnimationFrame(tick);
  if (now < due) return;
  const next = at + 1 < count ? at + 1 : $("loop").checked ? 0 : -1;
  if (next < 0) { press(false); return; }
  if (images.some((_, set) => needed().includes(set) && image(set, next).isBroken)) { press(false); show(next); return; }
  if (!isReady(next)) return;
  for (let k = 1; k <= AHEAD; k++) for (const set of needed()) image(set, (next + k) % count);
  const step = 1000 / Math.max(Number($("rate").value) || data.rate, 0.1);
  due = Math.max(due + step, now - step);
  lately = [...lately.slice(-24), now];
  show(next, true);
}

function look(name) {
  if (sets.length < 2 && name !== "a") return;
  mode = name;
  for (const button of document.querySelectorAll("[data-mode]")) button.setAttribute("aria-pressed", button.dataset.mode === mode);
  $("gains").hidden = mode !== "difference";
  stage.classList.toggle("wipes", mode === "wipe");
  const named = { a: [0], b: [1], side: [0, 1], wipe: [0, 1], difference: [] }[mode];
  const words = named.map((set) => sets[set].name);
  if (mode === "difference") words.push(`difference of ${sets[0].name} and ${sets[1].name}`);
  $("names").replaceChildren(...(sets.length > 1 ? words : []).map((text) => Object.assign(document.createElement("span"), { textContent: text })));
  refresh();
}

function fit() {
  const exact = stage.classList.toggle("exact");
  $("fit").setAttribute("aria-pressed", exact);
}

$("scrub").max = count - 1;
$("scrub").addEventListener("input", () => { press(false); show(Number($("scrub").value)); });
$("play").addEventListener("click", () => press(!playing));
$("back").addEventListener("click", () => { press(false); show(at - 1); });
$("on").addEventListener("click", () => { press(false); show(at + 1); });
$("fit").addEventListener("click", fit);
$("gain").addEventListener("change", refresh);
for (const button of document.querySelectorAll("[data-mode]")) button.addEventListener("click", () => look(button.dataset.mode));

// Where a pointer stands across the picture, from 0 to 1, whatever the picture's size on the page.
function across(event) {
  const box = canvas.getBoundingClientRect();
  const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
  const left = box.left + (box.width - scale * canvas.width) / 2;
  return Math.min(Math.max((event.clientX - left) / (scale * canvas.width), 0), 1);
}
function drag(event) {
  if (mode !== "wipe" || !(event.buttons & 1)) return;
  wipe = across(event);
  if (drawn === at) draw(at);
}
stage.addEventListener("pointerdown", drag);
stage.addEventListener("pointermove", drag);

for (const figure of document.querySelectorAll("#curves figure")) {
  figure.addEventListener("click", (event) => {
    const [[first, last], [left, right]] = JSON.parse(figure.dataset.across);
    const box = figure.getBoundingClientRect();
    const time = first + (((event.clientX - box.left) / box.width - left) / (right - left)) * (last - first);
    let best = 0;
    data.times.forEach((other, k) => {
      if (other !== null && (data.times[best] === null || Math.abs(other - time) < Math.abs(data.times[best] - time))) best = k;
    });
    press(false);
    show(best);
  });
}

const keys = {
  " ": () => press(!playing), k: () => press(!playing),
  ArrowLeft: () => { press(false); show(at - 1); }, ArrowRight: () => { press(false); show(at + 1); },
  PageUp: () => { press(false); show(at - 10); }, PageDown: () => { press(false); show(at + 10); },
  Home: () => { press(false); show(0); }, End: () => { press(false); show(count - 1); },
  l: () => { $("loop").checked = !$("loop").checked; }, z: fit,
  1: () => look("a"), 2: () => look("b"), s: () => look("side"), w: () => look("wipe"), d: () => look("difference"),
};
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || ["number", "select-one"].includes(event.target.type)) return;
  if (event.key === " " && event.target.tagName === "SUMMARY") return;
  const act = keys[event.key];
  if (act) { event.preventDefault(); act(); }
});

const named = () => data.labels.indexOf(decodeURIComponent(location.hash.slice(1)));
addEventListener("hashchange", () => { if (named() >= 0 && named() !== at) { press(false); show(named()); } });
look(mode);
show(Math.max(named(), 0));
