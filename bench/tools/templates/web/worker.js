// The worker: simulates, and works out the reference and the errors, while the page stays free.
const blyskWorker = (core) => {
  const designs = new Map();
  const views = new Map();
  let simulation = null;
  let loaded = "";
  let settingsOfPage = null;

  const errorsOf = (words, settings, entry, model) => {
    const { width, height, tables, errorMap } = settingsOfPage;
    const { spans, design } = entry;
    const port = design.ports.o;
    const at = (name) => {
      const field = port.fields[name];
      const [word, shift, mask] = [field.offset >>> 5, field.offset & 31, 2 ** field.width - 1];
      return (base) => (words[base + word] >>> shift) & mask;
    };
    const [x, y, red, green, blue] = ["x", "y", "r", "g", "b"].map(at);
    const { reference, viewer } = settings;
    const exact = core.reference(spans, settings, viewer, reference.curve, model, reference.chord, tables.one);
    const [background] = new Uint32Array(Uint8Array.from(settingsOfPage.backgroundCodes).buffer);
    const [frame, golden, map] = [background, background, 0].map((color) => {
      const pixels = new Uint32Array(width * height).fill(color);
      return new Uint8ClampedArray(pixels.buffer);
    });
    const order = new Int32Array(spans.fragments);
    const errors = new Float64Array(3 * spans.shown);
    let shown = 0;
    for (let span = 0; span < spans.count; span++) {
      const left = spans.codes.x[span];
      const row = spans.codes.y[span];
      for (let n = spans.first[span]; n < spans.first[span + 1]; n++) {
        const base = n * port.words;
        const column = left + n - spans.first[span];
        if (x(base) !== column || y(base) !== row) throw new Error("another pixel came than was asked for");
        const place = 4 * (row * width + column);
        order[n] = spans.visible[n] ? place : -1;
        if (!spans.visible[n]) continue;
        frame[place] = red(base);
        frame[place + 1] = green(base);
        frame[place + 2] = blue(base);
        let worst = 0;
        for (let c = 0; c < 3; c++) {
          const value = exact[3 * shown + c];
          golden[place + c] = Math.round(value);
          const error = Math.abs(frame[place + c] - value);
          errors[3 * shown + c] = error;
          if (error > worst) worst = error;
        }
        let step = 0;
        while (step < errorMap.limits.length - 1 && errorMap.limits[step] < worst) step++;
        for (let c = 0; c < 3; c++) map[place + c] = errorMap.colors[step][c];
        map[place + 3] = 255;
        shown++;
      }
    }
    return { frame, golden, map, order, shown, figures: core.errorFigures(errors) };
  };

  const load = (settings) => {
    const key = `${settings.design} ${settings.spans}`;
    const { module, design } = designs.get(settings.design);
    if (loaded !== key) {
      simulation = new core.Simulation(module, design, settingsOfPage.tables);
      simulation.load(views.get(settings.spans));
      loaded = key;
    }
    return { spans: views.get(settings.spans), design };
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
    frame: ({ settings, model }) => {
      const entry = load(settings);
      const before = performance.now();
      const run = simulation.run(settings, settings.viewer);
      const seconds = (performance.now() - before) / 1000;
      const { frame, golden, map, order, shown, figures } = errorsOf(run.words, settings, entry, model);
      const cycles = new Int32Array(order.length);
      for (let k = 0; k < cycles.length; k++) cycles[k] = run.each[2 * k];
      const result = {
        ...{ frame, golden, map, order, cycles },
        figures: {
          ...figures,
          ...{ shown, seconds, cycles: run.cycles, pixels: entry.spans.fragments, spans: entry.spans.count },
          ...{ gated: run.gated, wide: run.wide, milliseconds: performance.now() - before },
        },
      };
      return [result, [frame.buffer, golden.buffer, map.buffer, order.buffer, cycles.buffer]];
    },
    trace: ({ settings, from, to }) => {
      const { spans, design } = load(settings);
      const { module } = designs.get(settings.design);
      const short = new core.Simulation(module, design, settingsOfPage.tables);
      short.load(spans, from, to);
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
