// Draws the plots on the screen and keeps them, the recording and the keyboard in step. Without it the page shows its still figures.
(() => {
  "use strict";
  const root = document.documentElement;
  const data = JSON.parse(document.getElementById("data").textContent);
  const column = (k) => data.columns[k];
  const video = document.querySelector("video");
  const readout = document.getElementById("readout");
  const drawn = new Map(); // id → { plot, u, head }

  const ink = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const digits = (v, n = 5) => (v == null ? "–" : String(Number(v.toPrecision(n))).replace("-", "−").replace("e−", "e-"));
  const words = (axis) => (axis.unit ? `${axis.label} (${axis.unit})` : axis.label);

  // ---- time -------------------------------------------------------------------------------------------------------

  const clocked = data.plots.filter((p) => p.time && !p.map);
  const stamps = clocked.length ? column((clocked.find((p) => p.id === "angles") ?? clocked[0]).at) : [];
  const step = stamps.length > 1 ? (stamps[stamps.length - 1] - stamps[0]) / (stamps.length - 1) : 1 / 30;
  let now = stamps.length ? stamps[0] : null;

  // the last row that is not later
  const rowOf = (t) => {
    let [low, high] = [0, stamps.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (stamps[middle] <= t + 1e-6) low = middle; else high = middle - 1;
    }
    return low;
  };
  const nearest = (t) => {
    const row = rowOf(t);
    return row + 1 < stamps.length && stamps[row + 1] - t < t - stamps[row] ? row + 1 : row;
  };

  function show(t) {
    now = t;
    for (const one of drawn.values()) place(one);
    if (!readout || !stamps.length) return;
    const row = rowOf(t), angles = data.plots.find((p) => p.id === "angles");
    const each = angles ? angles.series.map((s) => `${s.name} = ${digits(column(s.values)[row], 4)} rad`) : [];
    readout.textContent = [`t = ${stamps[row].toFixed(3)} s`, ...each].join("   ");
  }

  function go(row) {
    if (!stamps.length) return;
    const t = stamps[Math.max(0, Math.min(stamps.length - 1, row))];
    show(t);
    if (!video) return;
    // a little into the frame, so that rounding does not show the one before
    video.currentTime = (t + 0.3 * step) / data.time_scale;
    dock();
  }

  function place({ plot, u, head }) {
    if (!plot.time || now == null || !head) return;
    const { min, max } = u.scales.x;
    head.hidden = !(now >= min && now <= max);
    if (!head.hidden) head.style.transform = `translateX(${u.valToPos(now, "x").toFixed(1)}px)`;
  }

  if (video) {
    const follow = (media) => show(stamps.length ? stamps[rowOf(media * data.time_scale)] : media * data.time_scale);
    if ("requestVideoFrameCallback" in video) {
      const each = (_, frame) => { if (!video.paused) follow(frame.mediaTime); video.requestVideoFrameCallback(each); };
      video.requestVideoFrameCallback(each);
    } else {
      video.addEventListener("timeupdate", () => { if (!video.paused) follow(video.currentTime); });
    }
    video.addEventListener("seeked", () => { if (video.paused) follow(video.currentTime); });
    video.addEventListener("play", dock);
    video.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -1, ArrowRight: 1, ",": -1, ".": 1 }[event.key];
      if (by) { event.preventDefault(); video.pause(); go(rowOf(now) + by * (event.shiftKey ? 10 : 1)); }
    });
  }

  // The recording stays in sight, small in a corner, while a plot further down moves it.
  let inSight = true, wanted = false;
  const film = document.getElementById("film");
  function dock() { wanted = true; settle(); }
  function settle() {
    if (!film) return;
    const docked = wanted && !inSight;
    // what is read must not jump when the recording leaves its place
    film.style.minHeight = docked ? (film.style.minHeight || `${film.offsetHeight}px`) : "";
    film.classList.toggle("docked", docked);
  }
  if (film) {
    new IntersectionObserver((seen) => { inSight = seen[0].isIntersecting; if (inSight) wanted = !video.paused; settle(); }).observe(film);
    const close = Object.assign(document.createElement("button"), { type: "button", className: "close", textContent: "✕", title: "close" });
    close.setAttribute("aria-label", "Close the small recording");
    close.onclick = () => { video.pause(); wanted = false; settle(); };
    film.firstElementChild.append(close);
  }

  // ---- plots ------------------------------------------------------------------------------------------------------

  function build(plot) {
    const figure = document.getElementById("plot-" + plot.id), live = figure.querySelector(".live");
    const named = plot.y.rows.length, at = column(plot.at), narrow = live.clientWidth < 560;
    const grid = { stroke: ink("grid"), width: 1 }, axis = { stroke: ink("text"), grid, ticks: grid, font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif" };
    const map = plot.map, edges = map && [map.x_edges, map.y_edges];
    const whole = plot.x.range ?? (map ? [edges[0][0], edges[0].at(-1)] : spread(plot, at, named));
    const reset = (u) => u.setScale("x", { min: whole[0], max: whole[1] });
    const labels = (u, values) => values.map((v) => (v == null ? "" : digits(v, 6)));
    const options = {
      width: Math.max(240, live.clientWidth),
      height: height(plot, !narrow),
      scales: {
        x: { time: false, range: (u, min, max) => (min === max ? [min - 1, max + 1] : [min, max]) },
        y: named ? { dir: -1, range: [0.5, named + 0.5] } : map ? { range: [edges[1][0], edges[1].at(-1)] }
          : { distr: plot.y.log ? 3 : 1, range: plot.y.range ?? (plot.y.log ? undefined : (u, low, high) => reach(plot, low, high)) },
      },
      axes: [
        { ...axis, label: words(plot.x), labelSize: 22, size: 34, values: labels },
        named ? { ...axis, size: narrow ? 150 : 190, splits: () => plot.y.rows.map((_, k) => k + 1), values: () => plot.y.rows, ticks: { show: false } }
          : { ...axis, label: words(plot.y), labelSize: 20, size: (u, values) => 26 + 7 * Math.max(3, ...(values ?? []).map((v) => String(v).length)), values: plot.y.log ? powers : labels, splits: plot.y.step ? (u, k, low, high) => Array.from({ length: Math.floor(high / plot.y.step) + 1 }, (_, n) => n * plot.y.step) : undefined },
      ],
      series: [{ label: plot.x.label, value: (u, v) => (v == null ? "" : `${digits(v, 6)} ${plot.x.unit}`) }, ...plot.series.map((s) => series(s, plot))],
      cursor: { drag: { x: true, y: false, dist: 5 }, points: { show: !named && !map }, y: false, bind: { dblclick: () => (event) => { reset(drawn.get(plot.id).u); } } },
      legend: { show: !map, live: !named, markers: { width: 0, fill: (u, k) => (k ? ink(plot.series[k - 1].ink) : "transparent") } },
      hooks: {
        drawClear: [(u) => under(u, plot)],
        draw: [(u) => over(u, plot, at)],
        setCursor: [(u) => u.root.classList.toggle("idle", u.cursor.idx == null)],
        setScale: [(u) => { const one = drawn.get(plot.id); if (one) place(one); }],
      },
    };
    if (plot.time) options.cursor.sync = { key: "t", setSeries: false };
    live.replaceChildren();
    const u = new uPlot(options, [map ? edges[0] : at, ...plot.series.map((s) => column(s.values))], live);
    if (plot.x.first) u.setScale("x", { min: plot.x.first[0], max: plot.x.first[1] }); else reset(u);
    u.root.classList.add("idle");
    if (named && plot.series.length < 2) u.root.querySelector(".u-legend")?.remove();
    if (map) live.append(scale(map));
    const bands = plot.bands.filter((band) => band.name);
    if (bands.length) live.append(key(bands));
    const one = { plot, u, head: null };
    if (plot.time) {
      one.head = Object.assign(document.createElement("div"), { className: "playhead" });
      u.over.append(one.head);
      let from = null;
      u.over.addEventListener("mousedown", (event) => { from = event.clientX; });
      u.over.addEventListener("click", (event) => {
        if (from != null && Math.abs(event.clientX - from) > 4) return;
        if (stamps.length) go(nearest(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x")));
      });
    }
    drawn.set(plot.id, one);
    place(one);
    return one;
  }

  // from where to where along x, intervals included, with some room
  function spread(plot, at, named) {
    const all = at.filter((v) => v != null);
    if (named) plot.series.forEach((s) => { (s.ends ?? []).forEach((k) => all.push(...column(k).filter((v) => v != null))); });
    if (plot.series.some((s) => s.style === "bars")) return [0, 1.04 * Math.max(...all, 1e-12)];
    if (!all.length) return [0, 1];
    let [low, high] = all.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
    const dots = named || plot.series.some((s) => s.style === "interval");
    const room = high > low ? (dots ? 0.04 : 0) * (high - low) : Math.abs(low) * 0.1 || 1;
    return [low - room, high + room];
  }

  // the same along y, of what is in sight
  function reach(plot, low, high) {
    if (low == null) [low, high] = [0, 1];
    plot.series.forEach((s) => (s.ends ?? []).forEach((k) => column(k).forEach((v) => { if (v != null) { low = Math.min(low, v); high = Math.max(high, v); } })));
    plot.bands.filter((b) => b.is_across).forEach((b) => { low = Math.min(low, b.ends[0]); high = Math.max(high, b.ends[1]); });
    const room = high > low ? 0.06 * (high - low) : Math.abs(low) * 0.1 || 1;
    return [low - room, high + room];
  }

  const powers = (u, values) => values.map((v) => (v == null || !Number.isInteger(Math.round(Math.log10(v) * 1e9) / 1e9) ? "" : digits(v, 3)));

  function series(s, plot) {
    const stroke = ink(s.ink), dots = s.style === "dots" || s.style === "interval", unit = plot.y.unit;
    return {
      label: s.name, stroke, width: 1.6, dash: s.style === "dashed" ? [7, 5] : undefined, spanGaps: false,
      paths: dots || s.style === "bars" ? () => null : undefined,
      points: { show: dots, size: s.style === "interval" ? 8 : 4, fill: stroke, stroke },
      value: (u, v) => (v == null ? "" : `${digits(v)} ${unit}`),
    };
  }

  function clipped(u, draw) {
    const c = u.ctx, { left, top, width, height } = u.bbox;
    c.save(); c.beginPath(); c.rect(left, top, width, height); c.clip(); draw(c, u.bbox); c.restore();
  }

  function under(u, plot) {
    clipped(u, (c, box) => {
      if (plot.map) cells(u, c, plot.map);
      for (const band of plot.bands) {
        const [a, b] = band.ends.map((v) => u.valToPos(v, band.is_across ? "y" : "x", true));
        c.globalAlpha = 0.18; c.fillStyle = ink(band.ink);
        if (band.is_across) c.fillRect(box.left, Math.min(a, b), box.width, Math.abs(b - a));
        else c.fillRect(Math.min(a, b), box.top, Math.max(1, Math.abs(b - a)), box.height);
      }
    });
  }

  function over(u, plot, at) {
    const ratio = devicePixelRatio;
    clipped(u, (c, box) => {
      c.font = `${12 * ratio}px system-ui, sans-serif`;
      for (const line of plot.lines) {
        const x = u.valToPos(line.at, "x", true);
        c.strokeStyle = c.fillStyle = ink("muted"); c.lineWidth = ratio; c.setLineDash([5 * ratio, 4 * ratio]);
        c.beginPath(); c.moveTo(x, box.top); c.lineTo(x, box.top + box.height); c.stroke(); c.setLineDash([]);
        const late = x > box.left + 0.8 * box.width;
        c.textAlign = late ? "right" : "left"; c.fillText(line.name, x + (late ? -5 : 5) * ratio, box.top + 14 * ratio);
      }
      const named = plot.y.rows.length;
      for (const s of plot.series) {
        const values = column(s.values); c.strokeStyle = c.fillStyle = ink(s.ink); c.lineWidth = 2 * ratio; c.setLineDash([]);
        if (s.style === "bars") values.forEach((y, k) => {
          if (y == null) return;
          const [x0, x1, top, bottom] = [u.valToPos(0, "x", true), u.valToPos(at[k], "x", true), u.valToPos(y - 0.3, "y", true), u.valToPos(y + 0.3, "y", true)];
          c.fillRect(x0, Math.min(top, bottom), Math.max(1, x1 - x0), Math.abs(bottom - top));
        });
        if (s.ends) values.forEach((y, k) => {
          const [low, high] = s.ends.map((e) => column(e)[k]);
          if (y == null || low == null || high == null) return;
          c.beginPath();
          if (named) { const v = u.valToPos(y, "y", true); c.moveTo(u.valToPos(low, "x", true), v); c.lineTo(u.valToPos(high, "x", true), v); }
          else { const v = u.valToPos(at[k], "x", true); c.moveTo(v, u.valToPos(low, "y", true)); c.lineTo(v, u.valToPos(high, "y", true)); }
          c.stroke();
        });
      }
    });
  }

  const most = (map) => Math.max(1e-300, ...map.values.flat().map((v) => Math.abs(v ?? 0)));
  function tint(share) {
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const [ground, end] = [dark ? [40, 44, 50] : [255, 255, 255], share < 0 ? (dark ? [86, 180, 233] : [0, 114, 178]) : (dark ? [240, 130, 50] : [213, 94, 0])];
    const s = Math.min(1, Math.abs(share));
    return `rgb(${ground.map((g, k) => Math.round(g + s * (end[k] - g)))})`;
  }
  function cells(u, c, map) {
    const all = most(map);
    map.values.forEach((column, i) => column.forEach((value, k) => {
      if (value == null) return;
      const [x0, x1] = [i, i + 1].map((n) => u.valToPos(map.x_edges[n], "x", true)), [y0, y1] = [k, k + 1].map((n) => u.valToPos(map.y_edges[n], "y", true));
      // whole pixels, or seams show between the cells
      const [left, right, top, bottom] = [x0, x1, y1, y0].map(Math.round);
      c.fillStyle = tint(value / all); c.fillRect(left, top, right - left, bottom - top);
    }));
  }
  function scale(map) {
    const p = Object.assign(document.createElement("p"), { className: "scale" }), all = most(map);
    p.append(`${map.name}: ${digits(-all, 3)} ${map.unit} `);
    for (let s = -1; s <= 1.01; s += 0.25) { const i = document.createElement("i"); i.style.background = tint(s); p.append(i); }
    p.append(` ${digits(all, 3)} ${map.unit}`);
    return p;
  }

  function key(bands) {
    const p = Object.assign(document.createElement("p"), { className: "scale" });
    for (const band of bands) { const i = document.createElement("i"); i.style.background = ink(band.ink); i.style.opacity = 0.35; p.append(i, ` ${band.name}   `); }
    return p;
  }

  // ---- keyboard ---------------------------------------------------------------------------------------------------

  document.addEventListener("keydown", (event) => {
    const live = event.target.closest?.(".live");
    if (!live || event.ctrlKey || event.metaKey || event.altKey) return;
    const one = drawn.get(live.parentElement.dataset.plot);
    if (!one) return;
    const { plot, u } = one, time = plot.time && stamps.length, row = time ? rowOf(now) : u.cursor.idx ?? 0;
    const by = event.shiftKey ? 10 : 1, last = (time ? stamps : u.data[0]).length - 1;
    const move = (k) => {
      k = Math.max(0, Math.min(last, k));
      if (time) { video?.pause(); go(k); }
      else u.setCursor({ left: u.valToPos(u.data[0][k], "x"), top: u.over.clientHeight / 2 });
    };
    const enlarge = (by) => {
      const { min, max } = u.scales.x, middle = time && now >= min && now <= max ? now : (min + max) / 2;
      u.setScale("x", { min: middle - (middle - min) * by, max: middle + (max - middle) * by });
    };
    const keys = {
      ArrowLeft: () => move(row - by), ArrowRight: () => move(row + by), Home: () => move(0), End: () => move(last),
      "+": () => enlarge(0.5), "=": () => enlarge(0.5), "-": () => enlarge(2), "−": () => enlarge(2),
      Escape: () => u.over.dispatchEvent(new MouseEvent("dblclick")),
      " ": () => { if (video) video.paused ? video.play() : video.pause(); },
    };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });

  // ---- copy and save ----------------------------------------------------------------------------------------------

  const status = document.getElementById("said");
  let silence;
  function say(words) {
    status.textContent = words; status.classList.add("seen");
    clearTimeout(silence); silence = setTimeout(() => status.classList.remove("seen"), 1800);
  }
  async function copy(text) {
    try { await navigator.clipboard.writeText(text); } catch {
      const field = Object.assign(document.createElement("textarea"), { value: text });
      document.body.append(field); field.select(); document.execCommand("copy"); field.remove();
    }
    say("Copied: " + text);
  }
  function save(blob, name) {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
    document.body.append(link); link.click(); link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    say("Saved: " + name);
  }
  function csv(plot) {
    if (plot.csv) return plot.csv;
    const columns = [plot.at, ...plot.series.map((s) => s.values), ...plot.series.flatMap((s) => s.ends ?? [])].map(column);
    return plot.header + "\n" + columns[0].map((_, row) => columns.map((c) => c[row] ?? "").join(",")).join("\n") + "\n";
  }
  document.addEventListener("click", async (event) => {
    const number = event.target.closest("button.n"), saving = event.target.closest("button[data-save]");
    if (number) copy(number.dataset.copy);
    if (!saving) return;
    const figure = saving.closest("figure"), id = figure.dataset.plot, kind = saving.dataset.save, still = figure.querySelector("img.still");
    if (kind === "csv") save(new Blob([csv(data.plots.find((p) => p.id === id))], { type: "text/csv" }), id + ".csv");
    if (kind === "svg") save(new Blob([Uint8Array.from(atob(still.src.split(",")[1]), (c) => c.charCodeAt(0))], { type: "image/svg+xml" }), id + ".svg");
    if (kind === "png") {
      const image = new Image(); image.src = still.src; await image.decode();
      const canvas = Object.assign(document.createElement("canvas"), { width: 2 * image.naturalWidth, height: 2 * image.naturalHeight });
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => save(blob, id + ".png"), "image/png");
    }
  });

  // ---- mode shapes ------------------------------------------------------------------------------------------------

  const moving = document.getElementById("moving-modes");
  if (moving && data.modes.length) {
    const svg = (name, attributes) => { const e = document.createElementNS("http://www.w3.org/2000/svg", name); for (const k in attributes) e.setAttribute(k, attributes[k]); return e; };
    const movers = data.modes.map((mode) => {
      const long = mode.links.reduce((sum, l) => sum + l.length, 0), largest = Math.max(...mode.links.map((l) => Math.abs(l.ratio)));
      const points = (phase) => {
        let [x, y] = [100, 20]; const all = [[x, y]];
        for (const l of mode.links) {
          const angle = (0.42 * l.ratio / largest) * Math.cos(phase + l.phase);
          x += (180 * l.length / long) * Math.sin(angle); y += (180 * l.length / long) * Math.cos(angle); all.push([x, y]);
        }
        return all;
      };
      const text = (all) => all.map((p) => p.map((v) => v.toFixed(1)).join(",")).join(" ");
      const slow = Math.max(1, Math.ceil(mode.hz / 1.5)), box = document.createElement("div");
      const drawing = svg("svg", { viewBox: "0 0 200 220", role: "img", "aria-label": `Mode ${mode.number}, ${digits(mode.hz)} Hz: the specimen between its two extremes` });
      drawing.append(svg("line", { x1: 70, x2: 130, y1: 20, y2: 20, class: "support" }));
      for (const phase of [0, Math.PI]) drawing.append(svg("polyline", { points: text(points(phase)), class: "ghost" }));
      const strip = svg("polyline", { points: text(points(0)), class: "strip m" + mode.number });
      const joints = points(0).map(([cx, cy]) => svg("circle", { cx, cy, r: 4, class: "joint" }));
      drawing.append(strip, ...joints);
      const label = document.createElement("p");
      label.textContent = `mode ${mode.number}, ${digits(mode.hz)} Hz` + (slow > 1 ? `, ${slow} times slower` : "");
      box.append(drawing, label); moving.querySelector(".row").append(box);
      return (seconds) => {
        const all = points(2 * Math.PI * mode.hz / slow * seconds);
        strip.setAttribute("points", text(all));
        joints.forEach((j, k) => { j.setAttribute("cx", all[k][0]); j.setAttribute("cy", all[k][1]); });
      };
    });
    const button = document.getElementById("modes-play");
    let runs = false;
    const run = (on) => {
      runs = on; button.textContent = on ? "Stop" : "Move"; button.setAttribute("aria-pressed", on);
      if (on) requestAnimationFrame(function frame(ms) { if (!runs) return; movers.forEach((m) => m(ms / 1000)); requestAnimationFrame(frame); });
    };
    button.onclick = () => run(!runs);
    new IntersectionObserver((seen) => { const there = seen[0].isIntersecting; if (!there) run(false); else if (!matchMedia("(prefers-reduced-motion: reduce)").matches) run(true); }).observe(moving);
  } else moving?.remove();

  // ---- begin ------------------------------------------------------------------------------------------------------

  const stills = () => document.querySelectorAll(".still").forEach((still) => { still.loading = "eager"; });
  addEventListener("beforeprint", stills);
  matchMedia("print").addEventListener("change", stills);
  root.classList.add("live-page");
  const height = (plot, wide) => (plot.y.rows.length ? 64 + 32 * plot.y.rows.length : wide ? 320 : 250);
  function draw() {
    for (const one of drawn.values()) one.u.destroy();
    drawn.clear();
    const lives = data.plots.map((plot) => document.querySelector(`#plot-${CSS.escape(plot.id)} .live`));
    // room first, so that nothing moves while they are drawn
    lives.forEach((live, k) => { live.style.minHeight = `${height(data.plots[k], live.clientWidth >= 560) + (data.plots[k].y.rows.length ? 0 : 24)}px`; });
    const round = ++rounds, rest = new Map(lives.map((live, k) => [live, data.plots[k]]));
    const one = (live) => {
      const plot = rest.get(live);
      if (!plot) return;
      rest.delete(live);
      nearby.unobserve(live);
      build(plot);
    };
    // what comes near is drawn at once, all else while nobody waits
    nearby?.disconnect();
    nearby = new IntersectionObserver((seen) => seen.filter((s) => s.isIntersecting).forEach((s) => one(s.target)), { rootMargin: "50% 0px" });
    lives.forEach((live) => nearby.observe(live));
    lives.filter((live) => live.getBoundingClientRect().top < innerHeight).forEach(one);
    root.dataset.firstMs = performance.now().toFixed(0);
    whenLoaded(function some() {
      if (round !== rounds) return;
      const until = performance.now() + 20;
      while (rest.size && performance.now() < until) one(rest.keys().next().value);
      if (rest.size) return idle(some);
      root.dataset.ready = String(drawn.size);
      root.dataset.readyMs = performance.now().toFixed(0);
    });
  }
  const idle = (work) => ("requestIdleCallback" in window ? requestIdleCallback(work, { timeout: 200 }) : setTimeout(work));
  const whenLoaded = (work) => (document.readyState === "complete" ? idle(work) : addEventListener("load", () => idle(work), { once: true }));
  let rounds = 0, nearby = null;
  draw();
  if (now != null) show(now);
  // the recording is the last and the largest part of the page: it is decoded when all else can be seen
  whenLoaded(() => {
    const film = document.getElementById("film-data");
    if (video && film) video.src = film.textContent;
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { delete root.dataset.ready; draw(); });
  let width = innerWidth;
  addEventListener("resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    for (const { u } of drawn.values()) { const w = u.root.parentElement.clientWidth; if (w > 0) u.setSize({ width: Math.max(240, w), height: u.height }); }
    for (const one of drawn.values()) place(one);
  });
})();
