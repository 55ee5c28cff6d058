// The live page. When the page needs data, it adds a script. The script calls `blysk.given` with the data.
const blysk = (() => {
  const byId = (id) => document.getElementById(id);
  const site = JSON.parse(byId("site").textContent);
  const core = blyskCore();
  const state = { ...site.start };
  const hexChannels = (color) => [1, 3, 5].map((k) => parseInt(color.slice(k, k + 2), 16) / 255);
  const pageState = { state, site, core, latest: null, inside: null, frames: 0 };

  function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  }

  function shown(value, digits = 4) {
    if (!Number.isFinite(value)) return "–";
    if (Number.isInteger(value) && Math.abs(value) < 1e15)
      return String(value)
        .replace("-", "−")
        .replace(/\B(?=(\d{3})+$)/g, Math.abs(value) >= 1e4 ? "\u202f" : "");
    const size = Math.abs(value);
    if (size >= 1e6) return `${shown(value / 1e6, digits)} million`;
    if (size < 1e-4) {
      const [mantissa, exponent] = value.toExponential(1).split("e-");
      return `${mantissa.replace("-", "−")}·10⁻${[...exponent].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("")}`;
    }
    const places = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
    return value.toFixed(Math.min(places, 8)).replace("-", "−");
  }

  // Data and modules.

  const promises = new Map();
  const waiting = new Map();

  function given(name, value) {
    waiting.get(name)(value);
  }

  function wanted(name, path) {
    if (!promises.has(name)) {
      const promise = new Promise((resolve, reject) => {
        waiting.set(name, resolve);
        const script = make("script", { src: path });
        script.addEventListener("error", () => {
          promises.delete(name);
          reject(new Error(`${path} is missing`));
        });
        document.head.append(script);
      });
      promises.set(name, promise);
    }
    return promises.get(name);
  }

  // The worker runs the text of functions of this script, because a page from a disk may not load a file for a worker.

  let worker = null;
  const answers = new Map();
  let asked = 0;

  function startWorker() {
    const text = `"use strict";(${blyskWorker})((${blyskCore})());`;
    worker = new Worker(URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
    worker.onmessage = ({ data: { id, result, error } }) => {
      const { resolve, reject } = answers.get(id);
      answers.delete(id);
      if (error) reject(new Error(error));
      else resolve(result);
    };
    ask("start", { site: { ...site, backgroundCodes: [...hexChannels(site.background).map((c) => c * 255), 255] } });
  }

  function ask(kind, message, moved = []) {
    return new Promise((resolve, reject) => {
      answers.set(++asked, { resolve, reject });
      worker.postMessage({ kind, id: asked, ...message }, moved);
    });
  }

  const ready = new Map();

  function once(name, work) {
    if (!ready.has(name)) {
      const promise = work();
      ready.set(name, promise);
      promise.catch(() => ready.delete(name));
    }
    return ready.get(name);
  }

  const designOf = (name) =>
    once(`design ${name}`, async () => {
      const design = await wanted(name, `modules/${name}.js`);
      const bytes = await core.unpacked(design.wasm);
      const { wasm: _, ...rest } = design;
      await ask("design", { name, design: rest, bytes });
      return rest;
    });

  const spansOf = (name) =>
    once(`spans ${name}`, async () => {
      const bytes = await core.unpacked(await wanted(name, `spans/${name}.js`));
      const spans = core.spansOf(bytes, site.columns);
      await ask("spans", { name, bytes });
      return spans;
    });

  // The texture of a mesh; `null` for the name `null`.
  const textureOf = (name) =>
    once(`texture ${name}`, async () => {
      if (name === null) return null;
      const { picture, halves, ...rest } = await wanted(`texture-${name}`, `textures/${name}.js`);
      const texture = core.textureOf(rest, ...(await Promise.all([picture, halves].map(core.unpacked))));
      await ask("texture", { name, texture });
      return texture;
    });

  const modelOf = (name) => once(`model ${name}`, () => wanted(`model-${name}`, `models/${name}.js`));

  // A frame.

  const view = () => site.meshes[state.mesh].views[state.view];

  // Whether the mesh needs a module with an albedo, and the name of the module of a method and a model for this mesh.
  const colored = () => site.meshes[state.mesh].albedo;
  const moduleOf = (method, model) => `${method}-${model}${colored() ? "-albedo" : ""}`;
  const modules = () => Object.values(site.designs).filter(({ albedo }) => albedo === colored());

  function settingsNow(name = state.method, reflection = state.model) {
    const reference = site.references[state.reference];
    const method = site.methods[name];
    // Lobes of a model with a roughness may be very narrow, so the spans are those of the largest exponent.
    const rough = site.rough.includes(reflection);
    const band = site.bands.findIndex((most) => (rough ? site.mostExponent : state.exponent) <= most);
    const { direction, exponent, roughness, ambient, diffuse, specular } = state;
    return {
      ...{ direction, exponent, roughness, ambient, diffuse, specular },
      design: moduleOf(name, reflection),
      spans: view().streams[name][band],
      texture: colored() ? state.mesh : null,
      viewer: view().axes[2],
      color: hexChannels(state.color).map(core.linear),
      light: hexChannels(state.light).map(core.linear),
      reference: {
        curve: reference.curve ?? method.curve,
        chord: reference.curve ? false : method.chord,
        model: (!rough && !site.mirrored.includes(reflection) && reference.model) || reflection,
      },
    };
  }

  // Settings of the rival, which is drawn right of the divider; `null` if the exact frame is drawn there.
  function rivalNow() {
    if (state.compare !== "rival" || !site.rival || state.method === site.rival || colored()) return null;
    const model = `${site.rival}-${state.model}` in site.designs ? state.model : site.rivalModel;
    return settingsNow(site.rival, model);
  }

  let busy = false;
  let again = false;
  let painted = 0;
  let pause = 0;

  async function refresh() {
    again = true;
    if (busy) return;
    busy = true;
    try {
      while (again) {
        again = false;
        const settings = settingsNow();
        const rival = rivalNow();
        const [model] = await Promise.all([
          modelOf(settings.reference.model),
          textureOf(settings.texture),
          ...[settings, rival].filter(Boolean).flatMap((of) => [designOf(of.design), spansOf(of.spans)]),
        ]);
        if (again) continue;
        const result = await ask("frame", { settings, model, rival });
        paint(settings, result);
        if (orbiting) turnLight();
      }
      failed("");
    } catch (error) {
      failed(`The simulation stopped: ${error.message}.`);
    } finally {
      busy = false;
    }
  }

  function failed(text) {
    byId("failure").hidden = !text;
    byId("failure").textContent = text;
  }

  function draw(id, pixels) {
    byId(id).getContext("2d").putImageData(new ImageData(pixels, site.width, site.height), 0, 0);
  }

  let told = 0;

  function paint(settings, result) {
    pageState.latest = { settings, ...result };
    pageState.frames++;
    stopSlow();
    draw("frame", result.frame);
    draw("golden", result.rival ? result.rival.frame : result.golden);
    draw("errors", result.map);
    const now = performance.now();
    const between = now - painted;
    painted = now;
    // This is a mean of times, not of rates. A browser's clock may be coarse, so the time between two frames may be 0.
    if (between < 400) pause = pause ? 0.9 * pause + 0.1 * between : between;
    else pause = result.figures.milliseconds;
    if (orbiting && now - told < 200) return;
    told = now;
    showLight();
    showFigures();
  }

  const lsb = (value) => `${shown(value, 3)} LSB`;

  // Shows the figures of the frame. `so` has the cycles and pixels until now, while the user watches the shading.
  function showFigures(so = null) {
    const { figures, rival, settings } = pageState.latest;
    const cycles = so ? so.cycles : figures.cycles;
    const each = so ? so.cycles / Math.max(so.pixels, 1) : figures.cycles / figures.pixels;
    const texts = {
      largest: lsb(figures.largest),
      p999: lsb(figures.p999),
      cycles: shown(cycles),
      each: so && !so.pixels ? "–" : shown(each, 3),
      gated: figures.gated === null ? "no gate" : `${shown((100 * figures.gated) / figures.pixels, 3)} %`,
      speed: shown(Math.round(figures.pixels / figures.seconds / 1000) * 1000),
      rate: shown(1000 / pause, 2),
    };
    for (const [name, text] of Object.entries(texts)) {
      const cell = document.querySelector(`[data-figure=${name}]`);
      cell.textContent = text;
      cell.dataset.value = { ...figures, cycles, each }[name] ?? "";
    }
    byId("ramp-high").textContent = shown(figures.largest, 3);
    const [method] = settings.design.split("-" + state.model);
    byId("own-text").textContent = `${method}: ${lsb(figures.largest)}`;
    byId("other-text").textContent = rival ? `${site.rival}: ${lsb(rival.largest)}` : "exact, float64";
  }

  // The light. Its distance from the centre of the picture is proportional to its angle from the viewer.

  const canvas = byId("frame");
  const RADIUS = 0.4; // Distance of a light at 90 degrees from the viewer, divided by the height of the picture.
  const along = (axis) => axis.reduce((sum, part, k) => sum + part * state.direction[k], 0);

  function lightPlace() {
    const length = Math.hypot(...state.direction);
    const [right, up, towards] = view().axes.map((axis) => along(axis) / length);
    const angle = Math.acos(Math.min(Math.max(towards, -1), 1));
    const across = Math.hypot(right, up) || 1;
    const distance = (angle / (Math.PI / 2)) * RADIUS;
    return [(right / across) * distance, (up / across) * distance];
  }

  function placeLight(x, y) {
    const distance = Math.min(Math.hypot(x, y) / RADIUS, 1.9);
    const angle = (distance * Math.PI) / 2;
    const around = Math.hypot(x, y) || 1;
    const parts = [(Math.sin(angle) * x) / around, (Math.sin(angle) * y) / around, Math.cos(angle)];
    const { axes } = view();
    state.direction = [0, 1, 2].map((k) => axes.reduce((sum, axis, n) => sum + axis[k] * parts[n], 0));
    leave();
    refresh();
    if (!orbiting) showLight();
  }

  function showLight() {
    const [x, y] = lightPlace();
    const sun = byId("sun");
    const aspect = site.width / site.height;
    sun.hidden = false;
    sun.style.left = `${Math.min(Math.max(50 + (100 * x) / aspect, 1), 99)}%`;
    sun.style.top = `${Math.min(Math.max(50 - 100 * y, 1), 99)}%`;
    const angle = (Math.hypot(x, y) / RADIUS) * 90;
    const side = [Math.abs(x) > 0.02 && (x > 0 ? "right" : "left"), Math.abs(y) > 0.02 && (y > 0 ? "above" : "below")];
    const text = `light ${Math.round(angle)}° from the viewer, ${side.filter(Boolean).join(", ") || "in front"}`;
    byId("light-text").textContent = text;
  }

  function pointed(event) {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  let down = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    canvas.setPointerCapture(event.pointerId);
    down = { x: event.clientX, y: event.clientY, moved: false };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!down) return;
    down.moved ||= Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4;
    if (!down.moved) return;
    setOrbit(false);
    const [x, y] = pointed(event);
    placeLight((x - 0.5) * (site.width / site.height), 0.5 - y);
  });
  canvas.addEventListener("pointerup", (event) => {
    const clicked = down && !down.moved;
    down = null;
    if (!clicked) return;
    const [x, y] = pointed(event);
    setOrbit(false);
    look(Math.floor(x * site.width), Math.floor(y * site.height));
  });
  canvas.addEventListener("pointercancel", () => (down = null));
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (step) {
      event.preventDefault();
      setOrbit(false);
      const [x, y] = lightPlace();
      placeLight(x + 0.03 * step[0], y + 0.03 * step[1]);
    } else if (event.key === "Enter") {
      event.preventDefault();
      const { x, y } = pageState.inside ?? { x: site.width >> 1, y: site.height >> 1 };
      look(x, y);
    }
  });

  let orbiting = false;

  function setOrbit(on) {
    orbiting = on;
    byId("orbit").setAttribute("aria-pressed", on);
    if (on) turnLight();
  }

  function turnLight() {
    const [x, y] = lightPlace();
    const [cosine, sine] = [Math.cos(0.05), Math.sin(0.05)];
    const distance = Math.max(Math.hypot(x, y), 0.1) / (Math.hypot(x, y) || 1);
    placeLight(distance * (x * cosine - y * sine), distance * (x * sine + (y || 0.001) * cosine));
  }
  byId("orbit").addEventListener("click", () => {
    leave();
    setOrbit(!orbiting);
  });

  // The divider.

  function showSplit() {
    const stage = byId("frame").parentNode;
    stage.style.setProperty("--split", `${byId("split").value}%`);
    byId("own-text").hidden = Number(byId("split").value) < 8;
    byId("other-text").hidden = Number(byId("split").value) > 92;
  }
  byId("split").addEventListener("input", showSplit);

  // The same frame is drawn slowly, pixel by pixel, in the cycles in which the pixels came.

  let slow = 0;

  function stopSlow() {
    if (!slow) return;
    cancelAnimationFrame(slow);
    slow = 0;
    byId("slow").setAttribute("aria-pressed", false);
    draw("frame", pageState.latest.frame);
    showFigures();
  }

  function watch() {
    if (slow) return stopSlow();
    setOrbit(false);
    const { frame, order, cycles, figures } = pageState.latest;
    const background = hexChannels(site.background).map((c) => c * 255);
    const pixels = new Uint8ClampedArray(frame.length);
    for (let k = 0; k < pixels.length; k++) pixels[k] = k % 4 < 3 ? background[k % 4] : 255;
    byId("slow").setAttribute("aria-pressed", true);
    const start = performance.now();
    let at = 0;
    const show = (now) => {
      const clock = (figures.cycles * (now - start)) / 6000;
      for (; at < cycles.length && cycles[at] <= clock; at++)
        for (let c = 0; order[at] >= 0 && c < 3; c++) pixels[order[at] + c] = frame[order[at] + c];
      draw("frame", pixels);
      showFigures({ cycles: Math.min(Math.floor(clock), figures.cycles), pixels: at });
      if (at < cycles.length) slow = requestAnimationFrame(show);
      else {
        stopSlow();
        showLight();
      }
    };
    byId("split").value = 100;
    showSplit();
    slow = requestAnimationFrame(show);
  }
  byId("slow").addEventListener("click", watch);

  // Controls.

  const controls = ["compare", "method", "model", "reference", "mesh", "color", "light", "ambient", "diffuse", "specular"];

  const COMPARED = {
    exact: "normals of unit length at every pixel, computed in float64",
    rival: "normals between the ends of a span are interpolated linearly: they are too short, so highlights get dull",
  };

  function showControls() {
    for (const id of [...controls, "exponent", "roughness"]) byId(id).value = state[id];
    const rough = site.rough.includes(state.model);
    byId("exponent").parentNode.hidden = rough;
    byId("roughness").parentNode.hidden = !rough;
    byId("view-number").value = state.view;
    const views = site.meshes[state.mesh].views.length;
    byId("view-number").max = views - 1;
    byId("view-number").parentNode.hidden = views < 2;
    for (const option of byId("method").options) option.disabled = !modules().some(({ method }) => method === option.value);
    for (const option of byId("model").options) option.disabled = !(moduleOf(state.method, option.value) in site.designs);
    for (const output of byId("controls").querySelectorAll("output")) {
      const value = byId(output.htmlFor.value).value;
      output.textContent = output.htmlFor.value === "view-number" ? `${Number(value) + 1} of ${views}` : value;
    }
    const { text } = site.references[state.reference];
    for (const option of byId("compare").options) option.disabled = option.value === "rival" && colored();
    byId("mesh-text").textContent = site.meshes[state.mesh].text;
    byId("method-text").textContent = site.methods[state.method].text.replaceAll("`", "");
    byId("compare-text").textContent = COMPARED[rivalNow() ? "rival" : "exact"];
    byId("explained").replaceChildren(
      make("p", {}, make("strong", {}, state.method), ` ${site.methods[state.method].text.replaceAll("`", "")}`),
      make("p", {}, make("strong", {}, site.references[state.reference].title), ` ${text}`),
    );
    showLight();
  }

  function changed() {
    showControls();
    leave();
    refresh();
  }

  // Closes the inside view. Its trace belongs to an earlier frame.
  function leave() {
    if (byId("inside").hidden) return;
    pageState.inside = null;
    delete document.body.dataset.inside;
    byId("mark").hidden = byId("inside").hidden = true;
    stopPlay();
  }

  byId("controls").addEventListener("input", ({ target }) => {
    const number = target.type === "range" ? Number(target.value) : target.value;
    const before = colored();
    state[target.id === "view-number" ? "view" : target.id] = number;
    if (target.id === "mesh") state.view = 0;
    // The colour of the surface multiplies the albedo, so a surface with an albedo is white at first.
    if (before !== colored()) Object.assign(state, { color: before ? site.start.color : "#ffffff", compare: "exact" });
    if (!(moduleOf(state.method, state.model) in site.designs)) {
      const { method, model } = modules().find((of) => of.method === state.method) ?? modules()[0];
      Object.assign(state, { method, model });
    }
    changed();
  });
  byId("controls").addEventListener("submit", (event) => event.preventDefault());
  byId("close").addEventListener("click", leave);
  byId("again").addEventListener("click", () => {
    setOrbit(false);
    Object.assign(state, site.start);
    byId("split").value = 50;
    showSplit();
    changed();
  });

  // The inside view shows the span of a pixel, and the neighbouring spans, cycle by cycle.

  async function look(x, y) {
    setOrbit(false);
    const settings = settingsNow();
    const [design, spans, model, texture] = await Promise.all([
      designOf(settings.design),
      spansOf(settings.spans),
      modelOf(state.model),
      textureOf(settings.texture),
    ]);
    const { codes, first, visible } = spans;
    let span = -1;
    for (let k = 0; k < spans.count; k++) {
      const place = x - codes.x[k];
      if (codes.y[k] === y && place >= 0 && place < codes.length[k] && visible[first[k] + place]) span = k;
    }
    byId("inside").hidden = false;
    byId("pixel-x").value = x;
    byId("pixel-y").value = y;
    // In a narrow window the inside view is below the picture, so the page scrolls to it.
    if (matchMedia("(max-width: 69.99rem)").matches) byId("inside").scrollIntoView({ block: "start" });
    if (span < 0) {
      byId("inside-title").textContent = `There is no surface at column ${x}, row ${y}.`;
      byId("pipeline").replaceChildren();
      byId("wave").replaceChildren();
      return;
    }
    const [from, to] = [Math.max(span - 2, 0), Math.min(span + 2, spans.count)];
    const trace = await ask("trace", { settings, from, to });
    const own = { ...settings.reference, ...site.methods[state.method] };
    const inside = { x, y, design, spans, span, from, to, trace, settings, model, texture };
    Object.assign(inside, { curve: own.curve, chord: own.chord });
    inside.start = first[span] - first[from];
    inside.length = codes.length[span];
    const status = design.ports.status.fields;
    inside.code = (name, clock) => core.get(trace.rows, (clock - 1) * trace.size, status[name]);
    // The pixels that the lights take, and those that the intensity unit takes, by the cycles.
    [inside.taken, inside.shaded] = ["taken", "shaded"].map((name) => {
      const found = new Map();
      for (let clock = 1; clock <= trace.count; clock++) if (inside.code(name, clock)) found.set(clock, found.size);
      return found;
    });
    inside.given = new Map(trace.cycles.map((clock, n) => [clock, n]));
    // Ages of a pixel when the intensity unit takes it, and when it comes out.
    [inside.lit, inside.done] = [design.stages[1].to, design.stages[3].to];
    inside.firstClock = trace.inputClocks[span - from];
    inside.lastClock = trace.cycles[inside.start + inside.length - 1];
    inside.exact = exactValues(inside);
    pageState.inside = inside;
    const codesOf = [0, 1, 2].map((c) => [codes[`normal_left.${c}`][span], codes[`normal_right.${c}`][span]]);
    const { one } = site.tables;
    const product = (k, n) => codesOf.reduce((sum, of) => sum + (of[k] / one) * (of[n] / one), 0);
    const cosine = product(0, 1) / Math.sqrt(product(0, 0) * product(1, 1) || 1);
    byId("inside-title").textContent =
      `Column ${x}, row ${y}: pixel ${x - codes.x[span] + 1} of a span of ${inside.length}, columns ${codes.x[span]} to ` +
      `${codes.x[span] + inside.length - 1}. The normal turns by ${shown((Math.acos(Math.min(cosine, 1)) * 180) / Math.PI, 3)}° along the span. ` +
      `The span goes in on cycle ${inside.firstClock}, and its pixels come out on cycles ${trace.cycles[inside.start]} to ${inside.lastClock}.`;
    const clock = byId("clock");
    clock.min = inside.firstClock;
    clock.max = inside.lastClock;
    const mark = byId("mark");
    mark.hidden = false;
    mark.style.left = `${(100 * (x + 0.5)) / site.width}%`;
    mark.style.top = `${(100 * (y + 0.5)) / site.height}%`;
    drawPipeline(inside);
    drawWave(inside);
    // The view starts at the cycle in which the terms of the pixel are added.
    const chosen = [...inside.shaded].find(([, n]) => n === inside.start + x - codes.x[span]);
    setClock(chosen[0]);
    document.body.dataset.inside = `${x},${y},${settings.design}`;
  }
  byId("look").addEventListener("click", () => look(Number(byId("pixel-x").value), Number(byId("pixel-y").value)));

  // Exact values of the words of a pixel, by the names of `blysk.sim.engines.probes`. A value is null if the word means
  // nothing for this pixel.
  function exactValues({ spans, from, settings, model, texture, curve, chord }) {
    const { one } = site.tables;
    const normal = [0, 0, 0];
    const albedo = [1, 1, 1];
    const color = texture && core.albedoOf(spans, texture, albedo);
    const shade = core.shader(settings, settings.viewer, model, chord);
    const terms = core.termsOf(settings);
    const slope = model.slopes?.[settings.exponent - 1];
    const found = new Map();
    return (name, n) => {
      if (!found.has(n)) {
        const fragment = spans.first[from] + n;
        const span = spans.span[fragment];
        const t = (fragment - spans.first[span]) / Math.max(spans.codes.length[span] - 1, 1);
        core.curveOf(curve, spans, span, one, normal)(t);
        if (color) color(span, fragment - spans.first[span]);
        const { cosine, highlight, diffuse, specular, surface, color: light } = shade(normal, albedo);
        const away = 1 - highlight;
        const product = cosine > 0 && slope !== undefined && slope * away < 1 ? slope * away : null;
        const base = product === null ? null : 1 - product;
        const power = (exponent) => (base === null ? null : base ** exponent);
        found.set(n, {
          ...{ normal_x: normal[0], normal_y: normal[1], normal_z: normal[2] },
          ...{ cosine, highlight_cosine: highlight, one_minus_cosine: away },
          ...{ product, base, base_2: power(2), base_4: power(4), base_8: power(8), diffuse, specular },
          red_diffuse: 255 * diffuse * terms.diffuse[0],
          red_specular: 255 * specular * terms.specular[0],
          albedo: albedo[0],
          red_surface: 255 * surface[0],
          red: 255 * light[0],
          ...{ r: core.encoded(light[0]), g: core.encoded(light[1]), b: core.encoded(light[2]) },
        });
      }
      return found.get(n)[name] ?? null;
    };
  }

  // The pixel to which a word of some age belongs; `undefined` if the age does not tell it. Pixels may wait in three
  // places: before the lights, behind them for their albedo, and behind the intensity unit for their coordinates.
  function pixelAt({ code, taken, shaded, given, lit, done }, age, clock) {
    const any = (name, from, to) => {
      for (let k = Math.max(from, 1); k < to; k++) if (code(name, k)) return true;
      return false;
    };
    if (age < 0) return any("waits", clock - 4, clock - age) ? undefined : taken.get(clock - age);
    if (age === 0) return taken.get(clock);
    if (age === lit) return shaded.get(clock);
    if (age >= done) return given.get(clock - age + done);
    if (age > lit) return any("held", clock - age + lit, clock) ? undefined : shaded.get(clock - age + lit);
    const pixel = taken.get(clock - age);
    return shaded.get(clock - age + lit) === pixel ? pixel : undefined;
  }

  // A word in a cycle: its code, its value, the pixel that it belongs to, the exact value and the error.
  function wordAt(inside, probe, clock) {
    const field = inside.design.ports.status.fields[probe.name];
    const code = inside.code(probe.name, clock);
    const value = core.decoded(code, field);
    const pixel = pixelAt(inside, probe.age, clock);
    let exact = pixel === undefined || !probe.exact ? null : inside.exact(probe.exact, pixel);
    const isDark = ["argument", "product", "base", "square", "square_2", "square_3"].includes(probe.name);
    if (exact !== null && isDark && (inside.exact("product", pixel) === null || gatedAt(inside, pixel))) exact = null;
    if (exact !== null) exact *= probe.unit;
    return { code, value, field, pixel, exact, off: exact === null ? null : value - exact };
  }

  function gatedAt(inside, pixel) {
    if (!("gated" in inside.design.ports.status.fields)) return 0;
    for (const [clock, n] of inside.taken) if (n === pixel) return inside.code("gated", clock);
    return 0;
  }

  function hue(inside, pixel, element) {
    const place = pixel === undefined ? -1 : pixel - inside.start;
    const own = place >= 0 && place < inside.length;
    element.classList.toggle("own", own);
    element.classList.toggle("other", pixel !== undefined && !own);
    if (own) element.style.setProperty("--hue", Math.round((300 * place) / Math.max(inside.length, 6)));
    return own ? String(place + 1) : pixel === undefined ? "" : "·";
  }

  const stageOf = { interpolator: "interpolator", gate: "light", diffuse: "light", specular: "light" };
  const clockParts = { cards: [], cells: null };

  function drawPipeline(inside) {
    const { design } = inside;
    const cards = [{ name: "setup", title: "Span and its setup", from: null }, ...design.stages].map((stage) => {
      const track = make("div", { class: "track" });
      const words = design.probes.filter(({ block }) => (stageOf[block] ?? block) === stage.name);
      const rows = words.map((probe) => {
        const cells = { pixel: make("td", { class: "chip" }), value: make("td"), exact: make("td"), off: make("td") };
        const row = make("tr", { "data-word": probe.name }, cells.pixel, make("th", { scope: "row" }, probe.title));
        row.append(cells.value, cells.exact, cells.off);
        return { probe, row, cells };
      });
      const table = make("table", { class: "words" });
      if (rows.length) {
        const head = ["", "word", "value", "exact", "off by"].map((text) => make("th", { scope: "col" }, text));
        table.append(make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...rows.map(({ row }) => row)));
      }
      const card = make("div", { class: "card", "data-stage": stage.name }, make("h3", {}, stage.title), track);
      if (rows.length) card.append(table);
      else card.append(make("p", { class: "note" }));
      return { stage, card, track, rows, dots: new Map() };
    });
    clockParts.cards = cards;
    byId("pipeline").replaceChildren(...cards.map(({ card }) => card));
  }

  function drawWave(inside) {
    const { design, firstClock, lastClock, trace, from } = inside;
    const cycles = Array.from({ length: lastClock - firstClock + 1 }, (_, k) => firstClock + k);
    const cells = new Map(cycles.map((clock) => [clock, []]));
    const add = (row, clock, text, attributes = {}) => {
      const cell = make("td", { "data-clock": clock, ...attributes }, text);
      cells.get(clock).push(cell);
      row.append(cell);
      return cell;
    };
    const head = make("tr", {}, make("th", { scope: "col" }, "clock"));
    for (const clock of cycles) {
      const button = make("button", { type: "button", tabindex: "-1", "data-clock": clock }, String(clock));
      const heading = make("th", { scope: "col" }, button);
      cells.get(clock).push(heading);
      head.append(heading);
    }
    const body = make("tbody");
    const into = make("tr", { "data-word": "span" }, make("th", { scope: "row" }, "span taken in"));
    for (const clock of cycles) {
      const k = trace.inputClocks.indexOf(clock);
      const cell = add(into, clock, k < 0 ? "" : k + from === inside.span ? "this" : "next");
      if (k + from === inside.span && k >= 0) hue(inside, inside.start, cell);
    }
    body.append(into);
    for (const probe of design.probes) {
      const format = design.ports.status.fields[probe.name];
      const kind = format.fraction ? `${format.signed ? "SQ" : "UQ"}(${format.width - format.fraction}, ${format.fraction})` : "";
      const title = make("th", { scope: "row" }, probe.title, make("small", {}, kind || `${format.width} bit`));
      const row = make("tr", { "data-word": probe.name }, title);
      for (const clock of cycles) {
        const word = wordAt(inside, probe, clock);
        const text = word.field.fraction ? shown(word.value, 4) : String(word.code);
        const cell = add(row, clock, text, { "data-code": word.code });
        hue(inside, word.pixel, cell);
      }
      body.append(row);
    }
    const out = make("tr", { "data-word": "pixel" }, make("th", { scope: "row" }, "pixel given"));
    for (const clock of cycles) {
      const n = trace.cycles.indexOf(clock);
      const cell = add(out, clock, n < 0 ? "" : "●");
      hue(inside, n < 0 ? undefined : n, cell);
    }
    body.append(out);
    byId("wave").replaceChildren(make("table", {}, make("thead", {}, head), body));
    clockParts.cells = cells;
  }
  byId("wave").addEventListener("click", ({ target }) => {
    const cell = target.closest("[data-clock]");
    if (cell) setClock(Number(cell.dataset.clock));
  });

  function setClock(clock) {
    const { inside } = pageState;
    if (!inside) return;
    clock = Math.min(Math.max(clock, inside.firstClock), inside.lastClock);
    inside.clock = clock;
    byId("clock").value = clock;
    byId("clock-text").textContent = `${clock} (${clock - inside.firstClock + 1} of ${inside.lastClock - inside.firstClock + 1})`;
    for (const cell of document.querySelectorAll(".wave .now")) cell.classList.remove("now");
    for (const cell of clockParts.cells.get(clock)) cell.classList.add("now");
    const heading = clockParts.cells.get(clock)[0];
    const wave = byId("wave");
    const sticky = wave.querySelector("tbody th").offsetWidth;
    const left = heading.offsetLeft - wave.scrollLeft;
    if (left < sticky || left > wave.clientWidth - 80) wave.scrollLeft = heading.offsetLeft - (wave.clientWidth + sticky) / 2;
    for (const card of clockParts.cards) showCard(inside, card, clock);
    byId("back").disabled = byId("first").disabled = clock === inside.firstClock;
    byId("step").disabled = clock === inside.lastClock;
    if (clock === inside.lastClock) stopPlay();
  }

  function showCard(inside, { stage, card, track, rows, dots }, clock) {
    for (const { probe, cells } of rows) {
      const word = wordAt(inside, probe, clock);
      cells.pixel.textContent = hue(inside, word.pixel, cells.pixel);
      cells.value.textContent = word.field.fraction ? shown(word.value, 6) : String(word.code);
      cells.value.title = `code ${word.code}`;
      cells.value.dataset.code = word.code;
      cells.exact.textContent = probe.exact ? shown(word.exact, 6) : "";
      cells.exact.dataset.value = word.exact ?? "";
      cells.off.textContent = word.off === null ? "" : shown(word.off, 2);
    }
    const inHere = new Map();
    if (stage.name === "setup") {
      const { inputClocks } = inside.trace;
      inputClocks.forEach((taken, k) => {
        const last = inside.spans.first[inside.from + k] - inside.spans.first[inside.from];
        const leaves = [...inside.taken].find(([, n]) => n === last)?.[0] + inside.design.stages[0].from;
        if (clock >= taken && clock <= leaves) inHere.set(last, (clock - taken) / Math.max(leaves - taken, 1));
      });
      const isOwn = inHere.has(inside.start);
      card.querySelector(".note").textContent = isOwn
        ? "This span is in its setup. The setup computes the values that all pixels of the span share."
        : inHere.size
          ? "Another span is in its setup. The pixels of this span are in the other stages."
          : "No span is in the setup.";
    } else {
      // A pixel that waits stays at the end of the lights, or of the intensity unit.
      const { lit, done, trace } = inside;
      const shaded = [...inside.shaded.keys()];
      for (const [taken, n] of inside.taken) {
        const [after, gone] = [clock - shaded[n], clock - trace.cycles[n]];
        let age = after < 0 ? Math.min(clock - taken, lit) : Math.min(lit + after, done - 1);
        if (gone >= 0) age = done + gone;
        if (age > stage.from && age <= stage.to) inHere.set(n, (age - stage.from - 0.5) / (stage.to - stage.from));
      }
    }
    for (const [n, dot] of dots)
      if (!inHere.has(n)) {
        dot.remove();
        dots.delete(n);
      }
    for (const [n, place] of inHere) {
      if (!dots.has(n)) {
        const dot = make("i");
        dot.textContent = stage.name === "setup" ? (n === inside.start ? "span" : "·") : hue(inside, n, dot);
        if (stage.name === "setup") dot.className = n === inside.start ? "own token" : "other";
        dots.set(n, dot);
        track.append(dot);
      }
      dots.get(n).style.left = `${100 * Math.min(Math.max(place, 0), 1)}%`;
    }
    card.classList.toggle("active", inHere.size > 0);
  }

  let playing = 0;

  function stopPlay() {
    clearInterval(playing);
    playing = 0;
    byId("play").setAttribute("aria-pressed", false);
    byId("play").textContent = "Play";
  }

  byId("play").addEventListener("click", () => {
    if (playing) return stopPlay();
    if (pageState.inside.clock === pageState.inside.lastClock) setClock(pageState.inside.firstClock);
    playing = setInterval(() => setClock(pageState.inside.clock + 1), 350);
    byId("play").setAttribute("aria-pressed", true);
    byId("play").textContent = "Stop";
  });
  byId("first").addEventListener("click", () => setClock(pageState.inside.firstClock));
  byId("back").addEventListener("click", () => setClock(pageState.inside.clock - 1));
  byId("step").addEventListener("click", () => setClock(pageState.inside.clock + 1));
  byId("clock").addEventListener("input", ({ target }) => setClock(Number(target.value)));
  byId("wave").addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step || !pageState.inside) return;
    event.preventDefault();
    setClock(pageState.inside.clock + step);
  });

  // The start of the page.

  document.documentElement.classList.add("scripted");
  for (const box of document.querySelectorAll("[data-color]")) box.style.background = `rgb(${box.dataset.color})`;
  if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function" || typeof Worker !== "function") {
    failed("This browser has no WebAssembly, which the live view needs. The rest of this page works.");
  } else {
    byId("view").hidden = false;
    startWorker();
    showControls();
    // Other scripts call `blysk`, which exists after this script. So the first frame waits for a timeout. The first
    // frames are slow, because the browser still optimises the code.
    showSplit();
    setTimeout(async () => {
      for (let k = 0; k < 4; k++) await refresh();
      document.body.dataset.frame = "ready";
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) setOrbit(true);
    });
  }

  return Object.assign(pageState, { given, refresh, look, setClock, setOrbit, settingsNow, rivalNow, wordAt, ask });
})();
