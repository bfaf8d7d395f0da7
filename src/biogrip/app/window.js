// Each choice is sent, and the parts of the page that it changes are shown anew.

const form = document.querySelector("form");
const shown = {};
for (const part of document.querySelectorAll("[data-part]")) shown[part.id] = part.outerHTML;
let queue = Promise.resolve();
let timer;

function send(action, more = {}) {
  queue = queue.then(() => answered(action, more)).catch((error) => fail(String(error)));
}

async function answered(action, more) {
  const body = new FormData(form);
  const sent = new Map(body);
  for (const [name, value] of Object.entries(more))
    for (const each of [value].flat()) body.append(name, each);
  const answer = await fetch(action, { method: "POST", body }).catch(() => null);
  if (!answer) return fail("The program has ended. Start it again: biogrip app.");
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  if (!answer.ok) return fail(`${page.title}: ${page.querySelector("p")?.textContent}`);
  fail("");
  show(page, new Map(new FormData(form)), sent);
  const next = document.querySelector("#command .problem") ? "command" : "result";
  if (action === "start") document.getElementById(next).scrollIntoView();
}

function fail(text) {
  const place = document.getElementById("failure");
  place.textContent = text;
  place.hidden = !text;
}

// What was typed while the answer came stays, and so does the focus.
function show(page, typed, sent) {
  const focused = document.activeElement.id;
  for (const part of page.querySelectorAll("[data-part]")) {
    if (shown[part.id] === part.outerHTML) continue;
    shown[part.id] = part.outerHTML;
    document.getElementById(part.id).replaceWith(part);
    for (const input of part.querySelectorAll("[name]")) {
      const value = typed.get(input.name);
      if (value === sent.get(input.name)) continue;
      if (input.type === "radio" || input.type === "checkbox") input.checked = input.value === value;
      else input.value = value;
    }
  }
  const [state, now] = [document, page].map((any) => any.getElementById("state"));
  if (state.textContent !== now.textContent) state.textContent = now.textContent;
  if (focused && document.activeElement.id !== focused) document.getElementById(focused)?.focus();
  draw();
  wait();
}

function wait() {
  clearTimeout(timer);
  if (document.querySelector("[data-running]")) timer = setTimeout(() => send("show"), 500);
}

form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("change", ({ target }) => {
  if (target.type !== "file") return send("choose");
  upload(target.files);
  target.value = "";
});
form.addEventListener("click", ({ target }) => {
  if (target.id === "copy")
    navigator.clipboard.writeText(document.getElementById("typed").textContent)
      .then(() => { document.getElementById("copied").textContent = "Copied."; }, (error) => fail(String(error)));
  else if (target.dataset.do) send(target.dataset.do, { do: target.value });
  // Its sizes are an example.
  if (target.value?.startsWith("--shape")) document.getElementById("shape")?.focus();
});
const upload = (files) => send("files", { files: [...files] });
document.addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("over");
});
document.addEventListener("dragleave", () => document.body.classList.remove("over"));
document.addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("over");
  upload(event.dataTransfer.files);
});

// The picture: points of a column over another, and the range that is used.
const [left, right, top_, bottom] = [150, 650, 10, 300];

function draw() {
  const svg = document.querySelector("#picture svg");
  if (!svg) return;
  const points = JSON.parse(document.querySelector("#picture script").textContent);
  const [across, upward] = ["across", "upward"].map((name) => document.getElementById(name).value);
  const pairs = (points[across] ?? []).map((x, i) => [+x, +points[upward]?.[i]])
    .filter((pair) => pair.every(isFinite));
  svg.replaceChildren();
  const add = (name, attributes, text = "") => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    svg.append(made);
  };
  if (pairs.length < 2) return add("text", { x: left, y: 40 }, "No numbers in both columns.");
  const scale = (values, from, to) => {
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const log = low > 0 && high > 100 * low ? Math.log : (value) => value;
    const size = log(high) - log(low) || 1;
    const at = (value) => from + ((to - from) * (log(value) - log(low))) / size;
    const back = (place) => {
      const value = log(low) + (size * (place - from)) / (to - from);
      return log === Math.log ? Math.exp(value) : value;
    };
    return { low, high, at, back };
  };
  const x = scale(pairs.map((pair) => pair[0]), left, right);
  const y = scale(pairs.map((pair) => pair[1]), bottom, top_);
  add("path", { d: pairs.map(([a, b]) => `M${x.at(a).toFixed(1)},${y.at(b).toFixed(1)}h0`).join("") });
  const short = (value) => +value.toPrecision(3);
  const units = JSON.parse(svg.dataset.units);
  const named = (name) => {
    const stated = [..."_ ([{/"].some((mark) => name.replace(/[µμ]/g, "u").includes(mark + units[name]));
    return units[name] && !stated ? `${name}, in ${units[name]}` : name;
  };
  add("text", { transform: `translate(24 ${(top_ + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, named(upward));
  add("text", { x: left, y: bottom + 20 }, short(x.low));
  add("text", { x: right, y: bottom + 20, "text-anchor": "end" }, short(x.high));
  add("text", { x: (left + right) / 2, y: bottom + 36, "text-anchor": "middle" }, named(across));
  add("text", { x: left - 6, y: bottom, "text-anchor": "end" }, short(y.low));
  add("text", { x: left - 6, y: top_ + 10, "text-anchor": "end" }, short(y.high));
  if (across !== svg.dataset.axis) return;
  const unit = +svg.dataset.unit;
  const ends = ["from", "until"].map((name) => document.getElementById(name));
  const within = (place) => Math.min(Math.max(place, left), right);
  const range = (one, other) =>
    add("rect", { x: Math.min(one, other), y: top_, width: Math.abs(other - one), height: bottom - top_ });
  if (ends.some((end) => end.value)) range(...ends.map((end, i) => end.value === "" || isNaN(end.value)
    ? [left, right][i] : within(x.at(end.value / unit))));
  const placed = (event) => {
    const box = svg.getBoundingClientRect();
    const size = Math.min(box.width / 660, box.height / 340);
    return within((event.clientX - box.x - (box.width - 660 * size) / 2) / size);
  };
  svg.onpointerdown = (down) => {
    svg.setPointerCapture(down.pointerId);
    svg.onpointerup = (up) => {
      const places = [placed(down), placed(up)].sort((one, other) => one - other);
      if (places[1] - places[0] < 5) return;
      ends.forEach((end, i) => { end.value = +(unit * x.back(places[i])).toPrecision(4); });
      send("choose");
    };
  };
}

draw();
wait();
