// The worker simulates, and computes the reference and the errors. The page can react meanwhile.
const blyskWorker = (core) => {
  const designs = new Map();
  const views = new Map();
  const textures = new Map();
  const simulations = new Map();
  const fragments = new Map();
  let settingsOfPage = null;

  // Stored values of fragments, by a key. A view has the same normals and the same albedo in each frame.
  const stored = (key, make) => {
    if (!fragments.has(key)) {
      if (fragments.size > 3) fragments.clear();
      fragments.set(key, make());
    }
    return fragments.get(key);
  };

  const empty = (color) => {
    const pixels = new Uint32Array(settingsOfPage.width * settingsOfPage.height).fill(color);
    return new Uint8ClampedArray(pixels.buffer);
  };

  const backgroundOf = () => new Uint32Array(Uint8Array.from(settingsOfPage.backgroundCodes).buffer)[0];

  const fieldsOf = (port) =>
    ["x", "y", "r", "g", "b"].map((name) => {
      const { offset, width } = port.fields[name];
      return [offset >>> 5, offset & 31, 2 ** width - 1];
    });

  // The frame of a run, and the index of each output pixel in the frame. The index of a hidden pixel is -1.
  const frameOf = (words, { spans, design }) => {
    const { width } = settingsOfPage;
    const size = design.ports.o.words;
    const [[xw, xs, xm], [yw, ys, ym], [rw, rs, rm], [gw, gs, gm], [bw, bs, bm]] = fieldsOf(design.ports.o);
    const frame = empty(backgroundOf());
    const order = new Int32Array(spans.fragments);
    for (let span = 0; span < spans.count; span++) {
      const first = spans.first[span];
      const left = spans.codes.x[span] - first;
      const row = spans.codes.y[span];
      for (let n = first; n < spans.first[span + 1]; n++) {
        const base = n * size;
        if (((words[base + xw] >>> xs) & xm) !== left + n || ((words[base + yw] >>> ys) & ym) !== row)
          throw new Error("a pixel came out of order");
        if (!spans.visible[n]) {
          order[n] = -1;
          continue;
        }
        const place = 4 * (row * width + left + n);
        order[n] = place;
        frame[place] = (words[base + rw] >>> rs) & rm;
        frame[place + 1] = (words[base + gw] >>> gs) & gm;
        frame[place + 2] = (words[base + bw] >>> bs) & bm;
      }
    }
    return { frame, order };
  };

  // Errors of the channels of all visible pixels, and the largest error of each visible pixel. If `golden` is given,
  // the rounded reference is drawn into it.
  const errorsOf = (frame, order, exact, golden) => {
    const errors = new Float64Array(exact.length);
    const worst = new Float64Array(exact.length / 3);
    let shown = 0;
    for (let n = 0; n < order.length; n++) {
      const place = order[n];
      if (place < 0) continue;
      const at = 3 * shown;
      const red = exact[at];
      const green = exact[at + 1];
      const blue = exact[at + 2];
      if (golden) {
        golden[place] = (red + 0.5) | 0;
        golden[place + 1] = (green + 0.5) | 0;
        golden[place + 2] = (blue + 0.5) | 0;
      }
      const r = Math.abs(frame[place] - red);
      const g = Math.abs(frame[place + 1] - green);
      const b = Math.abs(frame[place + 2] - blue);
      errors[at] = r;
      errors[at + 1] = g;
      errors[at + 2] = b;
      worst[shown++] = Math.max(r, g, b);
    }
    return { errors, worst };
  };

  // Map of errors. Its colours are equal steps from 0 to the largest error of the frame.
  const mapOf = (worst, largest, order) => {
    const { colors } = settingsOfPage.errorMap;
    const map = empty(0);
    const scale = colors.length / (largest || 1);
    let shown = 0;
    for (let n = 0; n < order.length; n++) {
      const place = order[n];
      if (place < 0) continue;
      const color = colors[Math.min(Math.max(Math.ceil(worst[shown++] * scale) - 1, 0), colors.length - 1)];
      map[place] = color[0];
      map[place + 1] = color[1];
      map[place + 2] = color[2];
      map[place + 3] = 255;
    }
    return map;
  };

  // Simulation of a design with its spans. Two simulations are stored: of the frame, and of the rival.
  const load = (settings) => {
    const key = `${settings.design} ${settings.spans}`;
    const { module, design } = designs.get(settings.design);
    if (!simulations.has(key)) {
      if (simulations.size > 1) simulations.delete(simulations.keys().next().value);
      const simulation = new core.Simulation(module, design, settingsOfPage.tables);
      simulation.load(views.get(settings.spans), textures.get(settings.texture));
      simulations.set(key, simulation);
    }
    return { spans: views.get(settings.spans), design, simulation: simulations.get(key) };
  };

  const exactOf = (settings, entry, model) => {
    const { reference, viewer, spans: name } = settings;
    const { spans } = entry;
    const found = stored(`${name} ${reference.curve}`, () =>
      core.normalsOf(spans, reference.curve, settingsOfPage.tables.one),
    );
    const texture = textures.get(settings.texture);
    const albedos = texture && stored(`${name} albedo`, () => core.albedosOf(spans, texture));
    return core.reference(found, settings, viewer, model, reference.chord, albedos);
  };

  const answer = {
    start: ({ site }) => {
      settingsOfPage = site;
    },
    design: async ({ name, design, bytes }) => {
      designs.set(name, { module: await WebAssembly.compile(bytes), design });
    },
    spans: ({ name, bytes }) => {
      views.set(name, core.spansOf(bytes, settingsOfPage.columns));
    },
    texture: ({ name, texture }) => {
      textures.set(name, texture);
    },
    frame: ({ settings, model, rival }) => {
      const entry = load(settings);
      const before = performance.now();
      const run = entry.simulation.run(settings, settings.viewer);
      const seconds = (performance.now() - before) / 1000;
      const { frame, order } = frameOf(run.words, entry);
      const golden = empty(backgroundOf());
      const exact = exactOf(settings, entry, model);
      const { errors, worst } = errorsOf(frame, order, exact, golden);
      const figures = core.errorFigures(errors);
      const map = mapOf(worst, figures.largest, order);
      const cycles = new Int32Array(order.length);
      for (let k = 0; k < cycles.length; k++) cycles[k] = run.each[2 * k];
      const result = {
        ...{ frame, golden, map, order, cycles },
        figures: {
          ...figures,
          ...{ shown: entry.spans.shown, seconds, cycles: run.cycles },
          ...{ pixels: entry.spans.fragments, spans: entry.spans.count, gated: run.gated, wide: run.wide },
        },
      };
      const moved = [frame.buffer, golden.buffer, map.buffer, order.buffer, cycles.buffer];
      if (rival) {
        const other = load(rival);
        const drawn = frameOf(other.simulation.run(rival, rival.viewer).words, other);
        const found = errorsOf(drawn.frame, drawn.order, exactOf(rival, other, model));
        result.rival = { frame: drawn.frame, largest: core.errorFigures(found.errors).largest };
        moved.push(drawn.frame.buffer);
      }
      result.figures.milliseconds = performance.now() - before;
      return [result, moved];
    },
    trace: ({ settings, from, to }) => {
      const { spans, design } = load(settings);
      const { module } = designs.get(settings.design);
      const short = new core.Simulation(module, design, settingsOfPage.tables);
      short.load(spans, textures.get(settings.texture), from, to);
      const trace = short.trace(settings, settings.viewer);
      return [trace, [trace.rows.buffer]];
    },
  };

  self.onmessage = async ({ data }) => {
    try {
      const [result, moved] = (await answer[data.kind](data)) ?? [null, []];
      self.postMessage({ id: data.id, result }, moved);
    } catch (error) {
      self.postMessage({ id: data.id, error: String(error.message ?? error) });
    }
  };
};
