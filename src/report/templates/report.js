"use strict";
// Hover and links of pictures, the paths of films, and the order of the shots. All data are inside the page.
const COLORS = ["#0072b2", "#d55e00"];
const tip = document.getElementById("tip");
const hide = () => { tip.style.display = "none"; };
const show = (text, event) => {
  tip.textContent = text;
  tip.style.display = "block";
  tip.style.left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8) + "px";
  tip.style.top = Math.max(event.clientY - 34, 4) + "px";
};
const draw = (name, attributes, parent) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  parent.append(made);
  return made;
};
const text = (words, x, y, size, parent, anchor = "start") => {
  draw("text", { x, y, "font-size": size, "text-anchor": anchor, fill: "#141414" }, parent).textContent = words;
};

// a picture names the shot of the nearest point, and leads to it
const named = new Map([...document.querySelectorAll("#shots > details")].map((shot) => [shot.dataset.name, shot.id]));
for (const data of document.querySelectorAll("script.spots")) {
  const { spots, labels } = JSON.parse(data.textContent);
  const picture = data.parentElement.querySelector("svg");
  const nearest = (event) => {
    const box = picture.getBoundingClientRect();
    const scale = picture.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    let [found, least] = [null, 14 * 14];
    for (const spot of spots) {
      const distance = (spot[0] - x) ** 2 + (spot[1] - y) ** 2;
      if (distance < least) [found, least] = [labels[spot[2]], distance];
    }
    return found;
  };
  picture.addEventListener("pointermove", (event) => {
    const found = nearest(event);
    picture.style.cursor = found ? "pointer" : "";
    if (found) show(`shot ${found.shot}: ${found.words}`, event); else hide();
  });
  picture.addEventListener("pointerleave", hide);
  picture.addEventListener("click", (event) => {
    const id = named.get(nearest(event)?.shot);
    if (id) location.hash = id;
  });
}

// a frame is [time, x, y, x − fitted x, y − fitted y] in 0.1 ms, 0.1 mm and µm
const stored = document.getElementById("tracks");
const shots = stored ? JSON.parse(stored.textContent) : [];
const fitted = ([, x, y, dx, dy]) => [x - dx / 100, -(y - dy / 100)];
const line = (points, attributes, parent) => draw("polyline", {
  points: points.map((point) => point.join(",")).join(" "), fill: "none", "vector-effect": "non-scaling-stroke", ...attributes,
}, parent);

// paths from above, both balls and the line of centres; of a single shot the frames and the balls at the impact
const plan = (own, parent) => {
  const all = own.flatMap((shot) => shot.balls.flat().map(fitted).concat(shot.contact.map(([x, y]) => [x, -y])));
  const ends = [0, 1].map((axis) => all.reduce(([low, high], at) => [Math.min(low, at[axis]), Math.max(high, at[axis])], [1e9, -1e9]));
  const room = own[0].radius * 1.3;
  const [left, top] = ends.map(([low]) => low - room);
  const [width, height] = ends.map(([low, high]) => high - low + 2 * room);
  const size = Math.max(width, height) / 45;
  const picture = draw("svg", { viewBox: `${left} ${top} ${width} ${height + 3 * size}` }, parent);
  picture.style.maxHeight = "80vh";
  for (const shot of own) {
    const group = draw("g", { class: "path" }, picture);
    shot.balls.forEach((frames, ball) => {
      line(frames.map(fitted), { stroke: "transparent", "stroke-width": 9 }, group);
      line(frames.map(fitted), { stroke: COLORS[ball], "stroke-width": own.length > 1 ? 1.2 : 2 }, group);
      const dots = own.length > 12 ? [] : frames;
      for (const [, x, y] of dots) draw("circle", { cx: x, cy: -y, r: size / 7, fill: COLORS[ball], "fill-opacity": 0.5 }, group);
      const [x, y] = shot.contact[ball];
      const outline = { cx: x, cy: -y, r: shot.radius, fill: "none", stroke: COLORS[ball], "vector-effect": "non-scaling-stroke" };
      if (own.length === 1) draw("circle", outline, group);
    });
    line(shot.contact.map(([x, y]) => [x, -y]), { stroke: "#141414", "stroke-width": 2 }, group);
    if (own.length === 1) continue;
    const words = `shot ${shot.name}: χ²/dof ${shot.chi2}, largest residual ${shot.largest} standard deviations`;
    group.addEventListener("pointermove", (event) => show(words, event));
    group.addEventListener("pointerleave", hide);
    group.addEventListener("click", () => { location.hash = shot.id; });
  }
  const bar = [100, 200, 500, 1000, 2000, 5000].findLast((length) => length < width / 3) || 100;
  const y = top + height + size;
  line([[left + size, y], [left + size + bar, y]], { stroke: "#141414", "stroke-width": 2 }, picture);
  text(`${bar / 100} cm`, left + 1.5 * size + bar, y + size / 3, size, picture);
  parent.classList.add("paths");
  const caption = document.createElement("figcaption");
  caption.innerHTML = '<span class="cue">cue ball</span>, <span class="object">object ball</span>; bars between them: line of centres at the impact';
  parent.append(caption);
};

// tracked less fitted places against time
const residuals = (shot, axis, parent) => {
  const frames = shot.balls.flat();
  const [first, last] = [Math.min(...frames.map(([t]) => t)), Math.max(...frames.map(([t]) => t))];
  const most = Math.max(1, ...frames.map((frame) => Math.abs(frame[3 + axis])));
  const picture = draw("svg", { viewBox: "0 0 600 200" }, parent);
  const at = (frame) => [70 + 510 * (frame[0] - first) / (last - first || 1), 90 - 75 * frame[3 + axis] / most];
  for (const value of [-1, 0, 1]) {
    line([[70, 90 - 75 * value], [580, 90 - 75 * value]], { stroke: value ? "#ddd" : "#141414" }, picture);
    text((value * most / 1000).toPrecision(2), 64, 94 - 75 * value, 13, picture, "end");
  }
  if (first < 0 && last > 0) line([[at([0])[0], 12], [at([0])[0], 170]], { stroke: "#888" }, picture);
  shot.balls.forEach((own, ball) => {
    for (const frame of own) {
      const [cx, cy] = at(frame);
      draw("circle", { cx, cy, r: 3, fill: COLORS[ball], "fill-opacity": 0.6 }, picture);
    }
  });
  text(`${"xy"[axis]}: tracked less fitted, mm, from ${first / 10} to ${last / 10} ms after the impact`, 325, 192, 13, picture, "middle");
};

if (shots.length > 0) {
  // in place of the picture that needs no script
  const figure = stored.previousElementSibling;
  figure.replaceChildren();
  plan(shots, figure);
}
for (const shot of shots) {
  const details = document.getElementById(shot.id);
  if (!details) continue;
  details.addEventListener("toggle", () => {
    if (!details.open || details.querySelector("figure")) return;
    const figure = document.createElement("figure");
    details.append(figure);
    plan([shot], figure);
    [0, 1].forEach((axis) => residuals(shot, axis, figure));
  });
}

const order = document.getElementById("order");
if (order) order.addEventListener("change", () => {
  const list = document.getElementById("shots");
  const value = (details) => Number(details.dataset[order.value]) * (order.value === "place" ? 1 : -1);
  [...list.children].sort((a, b) => value(a) - value(b)).forEach((details) => list.append(details));
});

const open = () => {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  if (!target || target.tagName !== "DETAILS") return;
  for (let at = target; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
  target.scrollIntoView();
};
addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details.section")) part.open = true; });
addEventListener("hashchange", open);
open();
