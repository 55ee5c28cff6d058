"use strict";
(() => {
  const byId = (id) => document.getElementById(id);

  function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  }

  // Text of a value as in the tables: numbers have four significant digits.
  function shown(value) {
    if (value === null || value === undefined) return "–";
    if (typeof value !== "number") return typeof value === "boolean" ? (value ? "yes" : "no") : String(value);
    const size = Math.abs(value);
    if (Number.isInteger(value) && size < 1e15) {
      const text = size >= 1e4 ? String(size).replace(/\B(?=(\d{3})+$)/g, "\u202f") : String(size);
      return (value < 0 ? "−" : "") + text;
    }
    if (size >= 1e-3 && size < 1e6) {
      const digits = 3 - Math.floor(Math.log10(size));
      if (digits <= 0) return shown(Math.round(value / 10 ** -digits) * 10 ** -digits);
      return value
        .toFixed(Math.min(digits, 8))
        .replace(/\.?0+$/, "")
        .replace("-", "−");
    }
    const [mantissa, exponent] = value.toExponential(3).split("e");
    const raised = (digit) => (digit === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);
    return `${mantissa.replace("-", "−")}·10${[...exponent.replace("+", "")].map(raised).join("")}`;
  }
  const withUnit = (value, unit) => (unit && value !== null ? `${shown(value)} ${unit}` : shown(value));

  // Tables. A click on a heading sorts the rows. Words in the search field filter the rows.

  function keyOf(cell) {
    if ("none" in cell.dataset) return null;
    if ("value" in cell.dataset) return Number(cell.dataset.value.replace(/inf$/, "Infinity"));
    return cell.textContent.trim();
  }

  function sortBy(table, heading, direction) {
    const column = [...heading.parentNode.children].indexOf(heading);
    const rows = [...table.tBodies[0].rows].map((row) => [keyOf(row.cells[column]), row]);
    rows.sort(([a], [b]) => {
      if (a === null || b === null) return (a === null) - (b === null);
      const order =
        typeof a === "number" && typeof b === "number"
          ? a - b
          : String(a).localeCompare(String(b), "en", { numeric: true });
      return direction * order;
    });
    table.tBodies[0].append(...rows.map(([, row]) => row));
    for (const other of heading.parentNode.children) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
  }

  // For each table, functions of a row. The row is shown if all of them return true.
  const conditions = new Map();

  function filter(table) {
    let count = 0;
    for (const row of table.tBodies[0].rows) {
      row.hidden = !conditions.get(table).every((condition) => condition(row));
      count += !row.hidden;
    }
    const text = table.closest("figure").querySelector(".rows");
    if (text) text.textContent = `${count} of ${table.tBodies[0].rows.length} rows`;
  }

  for (const table of document.querySelectorAll("table.sortable")) {
    conditions.set(table, []);
    for (const heading of table.tHead.rows[0].cells) {
      const button = make("button", { type: "button" }, ...heading.childNodes);
      button.addEventListener("click", () =>
        sortBy(table, heading, heading.getAttribute("aria-sort") === "ascending" ? -1 : 1),
      );
      heading.append(button);
    }
    if (table.tBodies[0].rows.length > 15) {
      const input = make("input", {
        type: "search",
        placeholder: "words",
        "aria-label": "Filter the rows by words",
      });
      const tools = make(
        "div",
        { class: "tools" },
        make("label", {}, "Filter ", input),
        make("span", { class: "rows", role: "status" }),
      );
      table.parentNode.before(tools);
      conditions.get(table).push((row) =>
        input.value
          .toLowerCase()
          .split(/\s+/)
          .every((word) => row.textContent.toLowerCase().includes(word)),
      );
      input.addEventListener("input", () => filter(table));
      filter(table);
    }
  }

  // A link to an element in a closed fold opens the fold. Printing opens all folds.
  const openTo = () => {
    const target = location.hash && byId(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let fold = target.querySelector(":scope > .fold") ?? target; fold; fold = fold.parentElement?.closest("details"))
      if (fold.tagName === "DETAILS") fold.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", openTo);
  document.addEventListener("click", ({ target }) => {
    if (target.closest(`a[href="${location.hash || "#"}"]`)) openTo();
  });
  openTo();
  addEventListener("beforeprint", () => {
    for (const fold of document.querySelectorAll(".fold")) fold.open = true;
  });

  // The table of contents is open if there is room beside the text.
  if (matchMedia("(max-width: 62rem)").matches) document.querySelector("nav details").open = false;

  if (!byId("data")) return;

  // Error against run time.

  const { figures, axes } = JSON.parse(byId("data").textContent);
  const { points, groups, errors, times, fronts } = figures;
  const pointOf = new Map(points.map((point) => [point.id, point]));
  const shotOf = new Map([...document.querySelectorAll(".shot")].map((shot) => [shot.dataset.point, shot]));
  const fileName = (path) =>
    path
      .split(/[\\/]/)
      .pop()
      .replace(/\.\w+$/, "");
  const headingOf = (axis) => (axis.unit ? `${axis.title}, ${axis.unit}` : axis.title);
  const capital = (text) => text[0].toUpperCase() + text.slice(1);

  const controls = {
    error: byId("error-axis"),
    time: byId("time-axis"),
    exponent: byId("exponent"),
    mesh: byId("mesh"),
  };
  for (const axis of errors) {
    const kind = axis.title.split(", ")[0];
    let group = [...controls.error.children].find((child) => child.label === kind);
    if (!group) controls.error.append((group = make("optgroup", { label: kind })));
    group.append(make("option", { value: axis.key }, headingOf(axis)));
  }
  for (const axis of times) controls.time.append(make("option", { value: axis.key }, headingOf(axis)));
  const exponents = [...new Set(points.map((point) => point.settings.exponent))].sort((a, b) => a - b);
  for (const exponent of exponents)
    controls.exponent.append(make("option", { value: exponent }, String(exponent)));
  const meshes = [...new Set(points.map((point) => point.settings.source))];
  for (const mesh of meshes) controls.mesh.append(make("option", { value: mesh }, fileName(mesh)));
  byId("mesh-label").hidden = meshes.length < 2;
  byId("mesh-label").style.display = meshes.length < 2 ? "none" : "";
  if (exponents.includes(100)) controls.exponent.value = 100;
  // Designs with equal cycles may differ in nanoseconds. So the axis is nanoseconds at first, if more than half as many
  // points have nanoseconds as have cycles.
  const having = (key) => points.filter((point) => point.times[key] !== null).length;
  if (having("ns_per_pixel") && 2 * having("ns_per_pixel") > having("cycles_per_pixel")) {
    controls.time.value = "ns_per_pixel";
  }

  const SHAPES = {
    documents: (r) => `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`,
    own: (r) => `M0 ${-1.35 * r}L${1.35 * r} 0L0 ${1.35 * r}L${-1.35 * r} 0Z`,
    baseline: (r) => `M0 ${-1.25 * r}L${1.2 * r} ${0.9 * r}L${-1.2 * r} ${0.9 * r}Z`,
    published: (r) => `M${-r} ${-r}L${r} ${r}M${-r} ${r}L${r} ${-r}`,
    software: (r) => `M${-r} ${-r}H${r}V${r}H${-r}Z`,
  };

  function drawn(name, attributes = {}, ...children) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  }

  function shape(group, radius) {
    const path = drawn("path", { class: "shape", d: SHAPES[group](radius) });
    return drawn("g", { class: `mark-${group}` }, path);
  }

  for (const { key, title } of groups) {
    if (!points.some((point) => point.group === key)) continue;
    const box = make("input", { type: "checkbox", value: key });
    box.checked = true;
    const icon = drawn(
      "svg",
      { width: 16, height: 16, viewBox: "-8 -8 16 16", "aria-hidden": "true" },
      shape(key, 4.6),
    );
    byId("groups").append(make("label", { title }, box, icon, title.split(/[:,]/)[0]));
  }

  const inScene = (point) =>
    String(point.settings.exponent) === controls.exponent.value &&
    point.settings.source === controls.mesh.value;
  const inGroups = (point) => byId("groups").querySelector(`input[value="${point.group}"]`).checked;

  // Scale of an axis of a given length: `place` maps a value to its distance from the better end. `ticks` are the
  // values of the grid lines.
  function scaleOf(values, axis, length) {
    const positive = values.filter((value) => value > 0);
    const logarithmic = axis.unit !== "dB" && positive.length > 0 && values.every((value) => value >= 0);
    const zeros = logarithmic && positive.length < values.length;
    const to = logarithmic ? Math.log10 : (value) => value;
    const used = logarithmic ? positive : values;
    let low = Math.min(...used.map(to)),
      high = Math.max(...used.map(to));
    const margin = Math.max((high - low) * 0.06, logarithmic ? 0.02 : 0.5);
    // Room for names at the better end.
    low -= axis.better === "more" ? margin : 2 * margin;
    high += axis.better === "more" ? 2 * margin : margin;
    const start = zeros ? 34 : 0; // Room for the value 0, which has no logarithm.
    const place = (value) => {
      if (zeros && value === 0) return axis.better === "more" ? length - 14 : 14;
      const share = (to(value) - low) / (high - low);
      return start + (length - start) * (axis.better === "more" ? 1 - share : share);
    };
    const least = logarithmic ? 10 ** low : low,
      most = logarithmic ? 10 ** high : high;
    let ticks = [];
    if (logarithmic && most / least > 8) {
      const steps = high - low > 3.5 ? [1] : [1, 2, 5];
      for (let power = Math.floor(low); power <= high; power++)
        ticks.push(...steps.map((step) => step * 10 ** power));
    } else {
      const rough = (most - least) / 6,
        power = 10 ** Math.floor(Math.log10(rough));
      const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
      for (let k = Math.ceil(least / step); k * step <= most; k++)
        ticks.push(Number((k * step).toPrecision(12)));
    }
    ticks = ticks.filter((tick) => tick >= least && tick <= most);
    if (zeros) ticks.unshift(0);
    return { place, ticks, logarithmic };
  }

  const plot = byId("plot"),
    tip = byId("tip");
  let places = []; // {point, x, y, dot} of each drawn point.
  let current = null;

  function chosen() {
    const error = errors.find((axis) => axis.key === controls.error.value);
    const time = times.find((axis) => axis.key === controls.time.value);
    const scene = points.filter(inScene);
    const front = new Set(fronts[`${error.key}|${time.key}`]);
    const measured = scene.filter(
      (point) => point.errors[error.key] !== null && point.times[time.key] !== null,
    );
    return { error, time, scene, front, measured, visible: measured.filter(inGroups) };
  }

  function describe(point, error, time) {
    return `${headingOf(error)}: ${shown(point.errors[error.key])}; ${headingOf(time)}: ${shown(point.times[time.key])}`;
  }

  function both(point, time, error) {
    return `${withUnit(point.times[time.key], time.unit)}, ${withUnit(point.errors[error.key], error.unit)}`;
  }

  function draw() {
    const { error, time, scene, front, measured, visible } = chosen();
    const width = Math.max(plot.clientWidth, 280),
      height = Math.round(Math.min(Math.max(width * 0.42, 320), 430));
    const left = 62,
      right = 18,
      top = 16,
      bottom = 52;
    const across = width - left - right,
      along = height - top - bottom;
    const svg = drawn("svg", {
      viewBox: `0 0 ${width} ${height}`,
      role: "group",
      "aria-label": `${headingOf(error)} against ${headingOf(time)}; arrow keys move between designs, Enter opens a design`,
    });
    places = [];
    let corners = [];
    if (measured.length) {
      const x = scaleOf(
        measured.map((point) => point.times[time.key]),
        time,
        across,
      );
      const y = scaleOf(
        measured.map((point) => point.errors[error.key]),
        error,
        along,
      );
      const px = (value) => left + x.place(value),
        py = (value) => top + along - y.place(value);
      let last = -Infinity;
      for (const tick of [...x.ticks].sort((a, b) => x.place(a) - x.place(b))) {
        svg.append(drawn("line", { class: "grid", x1: px(tick), x2: px(tick), y1: top, y2: top + along }));
        const text = shown(tick);
        if (px(tick) - last < text.length * 7 + 8) continue;
        last = px(tick);
        svg.append(drawn("text", { x: px(tick), y: top + along + 17, "text-anchor": "middle" }, text));
      }
      for (const tick of y.ticks) {
        svg.append(drawn("line", { class: "grid", x1: left, x2: left + across, y1: py(tick), y2: py(tick) }));
        svg.append(drawn("text", { x: left - 7, y: py(tick) + 4, "text-anchor": "end" }, shown(tick)));
      }
      places = visible
        .map((point) => ({ point, x: px(point.times[time.key]), y: py(point.errors[error.key]) }))
        .sort((a, b) => a.x - b.x || b.y - a.y);
      corners = places.filter(({ point }) => front.has(point.id));
      if (corners.length) {
        let path = `M${corners[0].x} ${top}V${corners[0].y}`;
        for (const corner of corners.slice(1)) path += `H${corner.x}V${corner.y}`;
        path += `H${left + across}`;
        svg.append(
          drawn("path", { class: "beaten", d: `${path}V${top}Z` }),
          drawn("path", { class: "frontier", d: path }),
        );
      }
    }
    const axisX = drawn(
      "text",
      { class: "axis", x: left + across, y: height - 10, "text-anchor": "end" },
      capital(headingOf(time)),
    );
    const axisY = drawn(
      "text",
      { class: "axis", x: -top, y: 15, "text-anchor": "end", transform: "rotate(-90)" },
      capital(headingOf(error)),
    );
    const betterX = drawn("text", { x: left, y: height - 10 }, "← better");
    const betterY = drawn("text", { x: -top - along, y: 15, transform: "rotate(-90)" }, "← better");
    svg.append(axisX, axisY, betterX, betterY);
    for (const place of places) {
      const { point } = place,
        onFront = front.has(point.id);
      const dot = drawn("g", { class: "dot", style: `--light:${point.colors[0]};--dark:${point.colors[1]}` }, shape(point.group, onFront ? 6 : 5));
      dot.dataset.point = point.id;
      dot.setAttribute("transform", `translate(${place.x} ${place.y})`);
      dot.setAttribute("role", "button");
      dot.setAttribute("tabindex", "-1");
      dot.setAttribute(
        "aria-label",
        `${point.label}. ${describe(point, error, time)}${onFront ? "; on the front" : ""}`,
      );
      if (onFront) dot.prepend(drawn("circle", { class: "halo", r: 10 }));
      dot.append(drawn("circle", { class: "ring", r: 12.5 }));
      place.dot = dot;
      svg.append(dot);
    }
    if (places.length)
      (places.find(({ point }) => point.id === current) || places[0]).dot.setAttribute("tabindex", "0");
    plot.querySelector("svg")?.remove();
    plot.prepend(svg);
    for (const [axis, title, better, room] of [
      [time, axisX, betterX, across],
      [error, axisY, betterY, along],
    ]) {
      if (title.getComputedTextLength() > room) title.textContent = capital(axis.unit || axis.title);
      if (title.getComputedTextLength() + better.getComputedTextLength() > room - 10) better.remove();
    }
    name(svg, front, corners, { left, right: left + across, top, bottom: top + along });
    hideTip();

    const none = scene.length - measured.length,
      hidden = measured.length - visible.length;
    byId("count").textContent =
      `${visible.length} of ${scene.length} designs are drawn.` +
      (none ? ` ${none} ${none === 1 ? "has" : "have"} no figure for an axis of the drawing.` : "") +
      (hidden ? ` ${hidden} ${hidden === 1 ? "is" : "are"} in groups that are not ticked.` : "");
    const kind = Object.keys(axes).find((key) => error.key.startsWith(`${key}_`));
    const figure = Object.keys(axes).find((key) => error.key.endsWith(`_${key}`));
    byId("meaning").replaceChildren(
      make("dt", {}, capital(error.title)),
      make("dd", {}, [axes[kind], axes[figure]].filter(Boolean).join(" ")),
      make("dt", {}, capital(time.title)),
      make("dd", {}, axes[time.key] || ""),
    );
    byId("front").replaceChildren(
      ...places
        .filter(({ point }) => front.has(point.id))
        .map(({ point }) => make("li", {}, link(point), make("span", {}, `: ${both(point, time, error)}`))),
    );
  }

  // Writes the names of points where there is room. Points on the front come first. Other points are named only on a
  // wide drawing.
  function name(svg, front, corners, edges) {
    const taken = places.map(({ x, y }) => [x - 7, y - 7, x + 7, y + 7]),
      lines = [];
    corners.forEach(({ x, y }, k) => {
      // The line of the front comes down from the corner before, and goes right to the next corner.
      const above = k ? corners[k - 1].y : edges.top,
        next = k + 1 < corners.length ? corners[k + 1].x : edges.right;
      lines.push([x - 1, above, x + 1, y], [x, y - 1, next, y + 1]);
    });
    const order = [...places].sort((a, b) => front.has(b.point.id) - front.has(a.point.id));
    for (const { point, x, y } of order) {
      const onFront = front.has(point.id);
      if (!onFront && edges.right - edges.left < 520) continue;
      const text = drawn(
        "text",
        { class: onFront ? "name on-front" : "name" },
        point.label.replace(/, software$/, ""),
      );
      svg.append(text);
      const wide = text.getComputedTextLength();
      const spots = [
        [x + 13, y + 4],
        [x - 13 - wide, y + 4],
        [x + 7, y - 12],
        [x + 7, y + 20],
        [x - wide - 5, y - 12],
        [x - wide - 5, y + 20],
        [x - wide / 2, y - 15],
        [x - wide / 2, y + 24],
      ];
      const free =
        (...others) =>
        ([a, b]) => {
          const [x0, y0, x1, y1] = [a, b - 10, a + wide, b + 3];
          if (x0 < edges.left + 2 || x1 > edges.right - 2 || y0 < edges.top || y1 > edges.bottom)
            return false;
          return !others
            .flat()
            .some((other) => x0 < other[2] && other[0] < x1 && y0 < other[3] && other[1] < y1);
        };
      const spot = spots.find(free(taken, lines)) || (onFront && spots.find(free(taken)));
      if (!spot) {
        text.remove();
        continue;
      }
      text.setAttribute("x", spot[0]);
      text.setAttribute("y", spot[1]);
      taken.push([spot[0] - 2, spot[1] - 11, spot[0] + wide + 2, spot[1] + 4]);
    }
  }

  function link(point) {
    const button = make("button", { type: "button", class: "point" }, point.label);
    button.addEventListener("click", () => open(point));
    return button;
  }

  function hideTip() {
    tip.hidden = true;
    for (const { dot } of places) dot.classList.remove("near");
  }

  function showTip(place) {
    const { error, time } = chosen();
    hideTip();
    place.dot.classList.add("near");
    const beside = places.filter(
      (other) => other !== place && Math.hypot(other.x - place.x, other.y - place.y) < 5,
    );
    tip.replaceChildren(make("strong", {}, place.point.label), both(place.point, time, error));
    if (beside.length)
      tip.append(make("br"), `In the same place: ${beside.map(({ point }) => point.label).join("; ")}`);
    tip.hidden = false;
    const ratio = plot.clientWidth / plot.querySelector("svg").viewBox.baseVal.width;
    const x = place.x * ratio,
      y = place.y * ratio;
    tip.style.left = `${Math.min(Math.max(x - tip.offsetWidth / 2, 4), plot.clientWidth - tip.offsetWidth - 4)}px`;
    tip.style.top = `${y - tip.offsetHeight - 18 > 0 ? y - tip.offsetHeight - 18 : y + 18}px`;
  }

  function nearest(event) {
    const svg = plot.querySelector("svg"),
      box = svg.getBoundingClientRect();
    const ratio = svg.viewBox.baseVal.width / box.width;
    const x = (event.clientX - box.left) * ratio,
      y = (event.clientY - box.top) * ratio;
    const [found] = [...places].sort((a, b) => Math.hypot(a.x - x, a.y - y) - Math.hypot(b.x - x, b.y - y));
    return found && Math.hypot(found.x - x, found.y - y) < 30 ? found : null;
  }

  plot.addEventListener("pointermove", (event) => {
    const place = nearest(event);
    plot.style.cursor = place ? "pointer" : "";
    if (place) showTip(place);
    else hideTip();
  });
  plot.addEventListener("pointerleave", hideTip);
  plot.addEventListener("click", (event) => {
    const place = nearest(event);
    if (place) open(place.point);
  });
  plot.addEventListener("focusin", (event) => {
    const place = places.find(({ dot }) => dot === event.target);
    if (place) showTip(place);
  });
  plot.addEventListener("focusout", hideTip);
  plot.addEventListener("keydown", (event) => {
    const index = places.findIndex(({ dot }) => dot === document.activeElement);
    if (index < 0) return;
    const upward = [...places].sort((a, b) => b.y - a.y || a.x - b.x),
      height = upward.indexOf(places[index]);
    const end = places.length - 1;
    const to = {
      ArrowRight: places[Math.min(index + 1, end)],
      ArrowLeft: places[Math.max(index - 1, 0)],
      ArrowUp: upward[Math.min(height + 1, end)],
      ArrowDown: upward[Math.max(height - 1, 0)],
      Home: places[0],
      End: places[end],
    }[event.key];
    if (to) {
      places[index].dot.setAttribute("tabindex", "-1");
      to.dot.setAttribute("tabindex", "0");
      current = to.point.id;
      to.dot.focus();
    } else if (event.key === "Enter" || event.key === " ") {
      open(places[index].point);
    } else {
      return;
    }
    event.preventDefault();
  });

  // The panel of a point.

  const panel = byId("panel");

  function lines(table, entries) {
    table.replaceChildren(
      make(
        "tbody",
        {},
        ...entries.map(([key, value]) => {
          const cell = make(
            "td",
            {},
            typeof value === "object" && value !== null ? JSON.stringify(value) : shown(value),
          );
          if (typeof value === "number") cell.title = value;
          return make("tr", {}, make("th", { scope: "row" }, key), cell);
        }),
      ),
    );
  }

  const verdict = (identical) => (identical ? "equals" : "differs from");
  const named = (values) => Object.entries(values).map(([key, value]) => [key.replaceAll("_", " "), value]);

  function open(point) {
    byId("panel-title").textContent = `${point.label}, exponent ${point.settings.exponent}`;
    byId("panel-verdict").textContent =
      `${capital(groups.find(({ key }) => key === point.group).title)}. To the eye, the frame ` +
      `${verdict(point.verdicts.total)} the exact frame, and ` +
      `${verdict(point.verdicts.method)} the frame with exact interpolation and the same model.`;
    const pictures = shotOf.get(point.id).querySelectorAll("span");
    byId("panel-pictures").replaceChildren(...[...pictures].map((picture) => picture.cloneNode(true)));
    byId("panel-command").textContent = point.command;
    byId("panel-copy").textContent = "Copy";
    const kinds = [...new Set(errors.map((axis) => axis.title.split(", ")[0]))];
    const rows = new Map();
    for (const axis of errors) {
      const [kind, ...rest] = axis.title.split(", ");
      const row = rest.join(", ") + (axis.unit ? `, ${axis.unit}` : "");
      if (!rows.has(row)) rows.set(row, new Map());
      rows.get(row).set(kind, axis);
    }
    byId("panel-errors").replaceChildren(
      make(
        "thead",
        {},
        make(
          "tr",
          {},
          make("td"),
          ...kinds.map((kind) => make("th", { scope: "col", class: "number" }, kind.replace(" error", ""))),
        ),
      ),
      make(
        "tbody",
        {},
        ...[...rows].map(([row, cells]) =>
          make(
            "tr",
            {},
            make("th", { scope: "row" }, row),
            ...kinds.map((kind) => {
              if (!cells.has(kind)) return make("td");
              const { key } = cells.get(kind),
                value = point.errors[key];
              return make(
                "td",
                { class: "number", "data-key": key, title: value ?? "no figure" },
                shown(value),
              );
            }),
          ),
        ),
      ),
    );
    lines(
      byId("panel-times"),
      times.map((axis) => [headingOf(axis), point.times[axis.key]]),
    );
    lines(byId("panel-hardware"), named({ ...point.hardware, ...point.counts }));
    lines(byId("panel-settings"), named(point.settings));
    if (!panel.open) panel.showModal();
    panel.scrollTop = 0;
  }

  byId("panel-ramp").replaceChildren(...document.querySelector("main .ramp").cloneNode(true).childNodes);
  byId("panel-close").addEventListener("click", () => panel.close());
  panel.addEventListener("click", (event) => {
    if (event.target !== panel) return;
    const box = panel.getBoundingClientRect();
    const inside =
      event.clientX >= box.left &&
      event.clientX <= box.right &&
      event.clientY >= box.top &&
      event.clientY <= box.bottom;
    if (!inside) panel.close();
  });
  byId("panel-copy").addEventListener("click", async () => {
    const code = byId("panel-command");
    getSelection().selectAllChildren(code);
    try {
      await navigator.clipboard.writeText(code.textContent);
      byId("panel-copy").textContent = "Copied";
    } catch {
      byId("panel-copy").textContent = document.execCommand("copy") ? "Copied" : "Marked";
    }
  });

  // The table and the pictures follow the drawing.

  for (const [id, shot] of shotOf) {
    const caption = shot.querySelector("figcaption"),
      button = link(pointOf.get(id));
    button.textContent = caption.textContent;
    caption.replaceChildren(button);
  }

  const table = byId("every-point");
  const headings = table ? [...table.tHead.rows[0].cells] : [];
  const titles = headings.map((heading) => heading.textContent.trim());
  const all = make("input", { type: "checkbox" });

  function showColumns() {
    const { error, time } = chosen();
    const usual = [
      "design",
      "group",
      "exponent",
      headingOf(error),
      headingOf(time),
      "multipliers",
      "clock rate, MHz",
    ];
    if (meshes.length > 1) usual.push("mesh");
    titles.forEach((title, column) => {
      const out = !all.checked && !usual.includes(title) && !title.startsWith("identical to the eye");
      for (const row of table.rows) row.cells[column].classList.toggle("out", out);
    });
    table.classList.toggle("wide", all.checked);
  }

  if (table) {
    const tools =
      table.closest("figure").querySelector(".tools") ||
      table.parentNode.parentNode.insertBefore(make("div", { class: "tools" }), table.parentNode);
    tools.append(
      make("label", {}, all, " all columns"),
      "The table has the designs of the drawing: its mesh, its exponent and the ticked groups.",
    );
    all.addEventListener("change", showColumns);
    for (const row of table.tBodies[0].rows) {
      const point = pointOf.get(row.dataset.point);
      row.cells[0].replaceChildren(link(point));
    }
    conditions
      .get(table)
      .push((row) => inScene(pointOf.get(row.dataset.point)) && inGroups(pointOf.get(row.dataset.point)));
  }

  function update() {
    draw();
    for (const [id, shot] of shotOf) shot.hidden = !inScene(pointOf.get(id)) || !inGroups(pointOf.get(id));
    if (table) {
      showColumns();
      filter(table);
    }
  }

  byId("explorer").hidden = false;
  byId("controls").addEventListener("change", update);
  byId("controls").addEventListener("submit", (event) => event.preventDefault());
  byId("groups").addEventListener("change", update);
  let drawnWidth = 0;
  new ResizeObserver(() => {
    if (plot.clientWidth && plot.clientWidth !== drawnWidth) {
      drawnWidth = plot.clientWidth;
      draw();
    }
  }).observe(plot);
  addEventListener("beforeprint", () => panel.open && panel.close());
  update();
})();
